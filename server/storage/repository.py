"""Disk use, and what goes, in SQL."""

from collections import defaultdict
from collections.abc import Collection, Sequence

from sqlalchemy import ColumnElement, delete, func, select, update
from sqlalchemy.orm import Session

from server.checkpoints.sums import add_to_sums
from server.database import tables
from server.http.paging import Window

_STARTED = "a training began with it"
_EVALUATED = "somebody had it evaluated"
_SEARCHED = "a study that goes on measures by it"
_RANKED = "its run stands by it on leaderboards"


class StorageRepository:
    """Reads and writes within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def page(self, visible: Collection[str] | None, window: Window) -> tuple[Sequence[tables.Experiment], int, int, int]:
        """Experiments of `visible` projects (None: all) that have checkpoints, the largest first.

        Returns:
            Them, how many there are on all pages, and the bytes of all, and of what goes of it.
        """
        experiment = tables.Experiment
        seen = [experiment.checkpoint_count > 0]
        if visible is not None:
            seen.append(experiment.project_id.in_(visible))
        sums = (
            func.count(),
            *(func.coalesce(func.sum(each), 0) for each in (experiment.checkpoint_bytes, experiment.going_bytes)),
        )
        total = self._session.execute(select(*sums).select_from(experiment).where(*seen)).one()
        query = select(experiment).where(*seen).order_by(experiment.checkpoint_bytes.desc(), experiment.id)
        rows = self._session.scalars(query.limit(window.limit).offset(window.offset)).all()
        return rows, total[0], int(total[1]), int(total[2])

    def curve_bytes(self, experiment_ids: Collection[str]) -> dict[str, int]:
        """Bytes of their compacted curves."""
        run, found = tables.Run, dict.fromkeys(experiment_ids, 0)
        parts = (
            (tables.MetricChunk.run_id, tables.MetricChunk.points),
            (tables.MetricAxis.run_id, tables.MetricAxis.data),
            (tables.ThinnedSeries.run_id, tables.ThinnedSeries.data),
        )
        for of_run, content in parts:
            query = (
                select(run.experiment_id, func.sum(func.length(content)))
                .join(run, run.id == of_run)
                .where(run.experiment_id.in_(experiment_ids))
                .group_by(run.experiment_id)
            )
            for experiment_id, size in self._session.execute(query):
                found[experiment_id] += int(size)
        return {experiment_id: size for experiment_id, size in found.items() if size}

    def of_experiment(self, experiment_id: str) -> dict[str, list[tables.Checkpoint]]:
        """Its checkpoints by step, by run."""
        query = (
            select(tables.Checkpoint)
            .join(tables.Run, tables.Run.id == tables.Checkpoint.run_id)
            .where(tables.Run.experiment_id == experiment_id)
            .order_by(tables.Checkpoint.step, tables.Checkpoint.created_at)
        )
        found: dict[str, list[tables.Checkpoint]] = defaultdict(list)
        for checkpoint in self._session.scalars(query):
            found[checkpoint.run_id].append(checkpoint)
        return found

    def reasons(self, checkpoints: Sequence[tables.Checkpoint]) -> dict[str, str]:
        """Why some of them stay whatever a rule says, by id."""
        ids = [checkpoint.id for checkpoint in checkpoints]
        key, asked = tables.ExperimentKey, tables.PolicyEvaluation
        run, trial = tables.Run, tables.StudyTrial
        found: dict[str, str] = {}
        for begin in range(0, len(ids), 500):
            some = ids[begin : begin + 500]
            mine = select(tables.Checkpoint.id).join(run).where(tables.Checkpoint.id.in_(some))
            searched = mine.join(trial, trial.experiment_id == run.experiment_id).where(trial.state == "running")
            ranked = mine.where(run.final_suite.is_not(None), run.final_step == tables.Checkpoint.step)
            evaluated = select(asked.checkpoint_id).where(asked.checkpoint_id.in_(some))
            started = select(key.text).where(key.key == tables.START_KEY, key.text.in_(some))
            reasons = ((searched, _SEARCHED), (ranked, _RANKED), (evaluated, _EVALUATED), (started, _STARTED))
            for query, reason in reasons:
                found |= {each: reason for each in self._session.scalars(query) if each is not None}
        return found

    def mark(self, checkpoint_ids: Collection[str], goes_at: float | None) -> None:
        """Say when they go; None: they stay."""
        ids = list(checkpoint_ids)
        for begin in range(0, len(ids), 500):
            some = tables.Checkpoint.id.in_(ids[begin : begin + 500])
            marked = tables.Checkpoint.goes_at.is_not(None)
            for experiment_id, count, size in self._sums(some, ~marked if goes_at is not None else marked):
                sign = 1 if goes_at is not None else -1
                add_to_sums(self._session, experiment_id, going_count=sign * count, going_bytes=sign * size)
            self._session.execute(update(tables.Checkpoint).where(some).values(goes_at=goes_at))

    def hasten(self, experiment_id: str, moment: float) -> int:
        """Let what goes of an experiment go at `moment`; how many checkpoints that are."""
        runs = select(tables.Run.id).where(tables.Run.experiment_id == experiment_id)
        going = update(tables.Checkpoint).where(tables.Checkpoint.run_id.in_(runs), tables.Checkpoint.goes_at > moment)
        return self._session.execute(going.values(goes_at=moment)).rowcount  # type: ignore[attr-defined,no-any-return]

    def due(self, moment: float, limit: int) -> list[tables.Checkpoint]:
        """Some that were to go by `moment`, the longest due first."""
        checkpoint = tables.Checkpoint
        query = select(checkpoint).where(checkpoint.goes_at <= moment).order_by(checkpoint.goes_at).limit(limit)
        return list(self._session.scalars(query))

    def remove(self, checkpoint_ids: Collection[str]) -> None:
        """Remove them with their evaluations."""
        some = tables.Checkpoint.id.in_(checkpoint_ids)
        for experiment_id, count, size in self._sums(some):
            add_to_sums(self._session, experiment_id, checkpoint_count=-count, checkpoint_bytes=-size)
        for experiment_id, count, size in self._sums(some, tables.Checkpoint.goes_at.is_not(None)):
            add_to_sums(self._session, experiment_id, going_count=-count, going_bytes=-size)
        self._session.execute(delete(tables.Checkpoint).where(some))

    def _sums(self, *which: ColumnElement[bool]) -> list[tuple[str, int, int]]:
        """How many of these checkpoints each experiment has, and their bytes."""
        query = (
            select(tables.Run.experiment_id, func.count(), func.sum(tables.Checkpoint.size))
            .join(tables.Checkpoint, tables.Checkpoint.run_id == tables.Run.id)
            .where(*which)
            .group_by(tables.Run.experiment_id)
        )
        return [(row[0], row[1], int(row[2])) for row in self._session.execute(query)]

    def with_new(self, since: float, limit: int) -> list[tuple[str, float]]:
        """Experiments whose runs have got checkpoints after `since`, with when the newest one came, the oldest first."""
        newest = func.max(tables.Checkpoint.created_at)
        query = (
            select(tables.Run.experiment_id, newest)
            .join(tables.Checkpoint, tables.Checkpoint.run_id == tables.Run.id)
            .where(tables.Checkpoint.created_at > since)
            .group_by(tables.Run.experiment_id)
            .order_by(newest)
            .limit(limit)
        )
        return [(row[0], row[1]) for row in self._session.execute(query)]
