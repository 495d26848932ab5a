"""What was measured on suites, in SQL."""

from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass

from sqlalchemy import ColumnElement, Float, and_, cast, func, or_, select
from sqlalchemy.orm import Session

from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.experiments.stored import read_training
from server.leaderboards.means import mean_of, spl_of

MOST_ENTRIES = 200
"""Trainings, and evaluations, of a leaderboard; the best of each."""


@dataclass(frozen=True)
class Trained:
    """A training by its runs' last evaluations, all on the same suite."""

    id: str
    name: str
    arrivals: list[int]
    episodes: list[int]
    spl: float | None
    steps: float | None


@dataclass(frozen=True)
class Seed:
    """The run that made a checkpoint."""

    run_id: str
    seed: int
    experiment_id: str
    experiment: str


class LeaderboardRepository:
    """Reads within the caller's transaction.

    Args:
        session: of the database.
        visible: projects that may be seen; None for all.
    """

    def __init__(self, session: Session, visible: Collection[str] | None) -> None:
        self._session = session
        self._visible = visible

    def suites(self) -> dict[str, tuple[str, int]]:
        """By hash, the name of each suite on which something was measured, and how many entries it has."""
        run, asked, usual = tables.Run, tables.PolicyEvaluation, tables.Evaluation
        name = select(usual.suite).where(usual.suite_hash == run.final_suite).limit(1).scalar_subquery()
        trained = (
            select(run.final_suite, name, func.count(run.experiment_id.distinct()))
            .join(tables.Experiment)
            .where(run.final_suite.is_not(None), tables.Experiment.study_id.is_(None), *self._seen())
            .group_by(run.final_suite)
        )
        found: dict[str, tuple[str, int]] = {}
        for suite_hash, suite, count in self._session.execute(trained):
            assert suite_hash is not None
            found[suite_hash] = (suite or suite_hash[:12], count)
        measured = (
            select(asked.suite_hash, func.min(asked.suite), func.count())
            .where(asked.suite_hash.is_not(None), self._asked_seen())
            .group_by(asked.suite_hash)
        )
        for suite_hash, suite, count in self._session.execute(measured):
            assert suite_hash is not None
            assert suite is not None
            found[suite_hash] = (suite, found.get(suite_hash, ("", 0))[1] + count)
        return found

    def trainings(self, suite_hash: str) -> list[Trained]:
        """The best trainings whose runs were measured on a suite, by the mean of their seeds' last success rates."""
        run, experiment = tables.Run, tables.Experiment
        # The best of a study's trials is the luckiest too: they are left out, the training that judges it is not.
        on_it = (run.final_suite == suite_hash, run.final_episodes > 0, experiment.study_id.is_(None))
        rate = func.avg(cast(run.final_arrivals, Float) / run.final_episodes)
        best = (
            select(experiment.id, experiment.name)
            .join(run)
            .where(*on_it, *self._seen())
            .group_by(experiment.id, experiment.name)
            .order_by(rate.desc(), experiment.id)
            .limit(MOST_ENTRIES)
        )
        names = {row[0]: row[1] for row in self._session.execute(best)}
        runs = (
            select(run.experiment_id, run.id, run.final_arrivals, run.final_episodes)
            .join(experiment)
            .where(run.experiment_id.in_(names), *on_it)
        )
        seeds: dict[str, list[tuple[str, int, int]]] = defaultdict(list)
        for experiment_id, run_id, arrivals, episodes in self._session.execute(runs.order_by(run.seed)):
            seeds[experiment_id].append((run_id, arrivals or 0, episodes or 0))
        final = CheckpointRepository(self._session).final_evaluations(
            [each[0] for own in seeds.values() for each in own], with_episodes=True
        )
        tasks = self._arrival_distances(names)
        return [
            Trained(
                key,
                name,
                [each[1] for each in seeds[key]],
                [each[2] for each in seeds[key]],
                mean_of([spl_of(final[each[0]], tasks[key]) for each in seeds[key] if each[0] in final]),
                mean_of([final[each[0]].steps_mean for each in seeds[key] if each[0] in final]),
            )
            for key, name in names.items()
        ]

    def seeds_of(self, rows: Collection[tables.PolicyEvaluation]) -> dict[str, Seed]:
        """By the checkpoint that was measured, the run that made it; without those that are gone."""
        run, experiment = tables.Run, tables.Experiment
        query = (
            select(tables.Checkpoint.id, run.id, run.seed, experiment.id, experiment.name)
            .join(run, run.id == tables.Checkpoint.run_id)
            .join(experiment, experiment.id == run.experiment_id)
            .where(tables.Checkpoint.id.in_({row.checkpoint_id for row in rows if row.checkpoint_id}))
        )
        return {row[0]: Seed(row[1], row[2], row[3], row[4]) for row in self._session.execute(query)}

    def _arrival_distances(self, experiment_ids: Collection[str]) -> dict[str, float]:
        row = tables.Experiment
        query = select(row.id, row.training).where(row.id.in_(experiment_ids))
        return {found[0]: read_training(found[1]).training.task.arrival_distance for found in self._session.execute(query)}

    def evaluations(self, suite_hash: str) -> list[tables.PolicyEvaluation]:
        """Evaluations on a suite that people have asked for, the newest first."""
        row = tables.PolicyEvaluation
        query = select(row).where(row.suite_hash == suite_hash, self._asked_seen())
        return list(self._session.scalars(query.order_by(row.created_at.desc()).limit(MOST_ENTRIES)))

    def evaluations_named(self, suites: Collection[str]) -> list[tables.PolicyEvaluation]:
        """Evaluations on suites of these names that are done, the newest first."""
        row = tables.PolicyEvaluation
        query = select(row).where(row.suite.in_(suites), row.figures.is_not(None), self._asked_seen())
        return list(self._session.scalars(query.order_by(row.created_at.desc()).limit(MOST_ENTRIES)))

    def _seen(self) -> list[ColumnElement[bool]]:
        experiment = tables.Experiment
        found: list[ColumnElement[bool]] = [experiment.deleted_at.is_(None)]
        if self._visible is not None:
            found.append(experiment.project_id.in_(self._visible))
        return found

    def _asked_seen(self) -> ColumnElement[bool]:
        row = tables.PolicyEvaluation
        mine = (
            select(tables.Checkpoint.id)
            .join(tables.Run, tables.Run.id == tables.Checkpoint.run_id)
            .join(tables.Experiment, tables.Experiment.id == tables.Run.experiment_id)
            .where(tables.Checkpoint.id == row.checkpoint_id, *self._seen())
        )
        upload = tables.UploadedPolicy
        sent = select(upload.id).where(upload.id == row.upload_id)
        if self._visible is not None:
            sent = sent.where(upload.project_id.in_(self._visible))
        return or_(and_(row.checkpoint_id.is_(None), row.upload_id.is_(None)), mine.exists(), sent.exists())
