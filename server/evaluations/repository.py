"""Evaluations that people asked for, in SQL."""

import zlib
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import TypeAdapter
from sqlalchemy import ColumnElement, Select, and_, func, or_, select, update
from sqlalchemy.orm import Session, undefer

from server.database import tables
from server.errors import NotFoundError
from server.evaluations.figures import figures_of
from server.evaluations.ways import packed
from server.http.paging import Window
from workers.job_protocol import Measurement
from workers.reporting import EpisodeResult

_EPISODES = TypeAdapter(tuple[EpisodeResult, ...])
_Query = TypeVar("_Query", bound=Select[*tuple[Any, ...]])


@dataclass(frozen=True)
class Wanted:
    """Which evaluations are asked for.

    Attributes:
        visible: projects that may be seen; None for all.
        suite_hash: on that suite only.
        run_id: of that run's policies only.
    """

    visible: Collection[str] | None = None
    suite_hash: str | None = None
    run_id: str | None = None

    def conditions(self) -> list[ColumnElement[bool]]:
        """For a query that knows evaluations, runs and experiments."""
        row, found = tables.PolicyEvaluation, []
        if self.visible is not None:
            mine = (tables.Experiment.project_id.in_(self.visible), tables.UploadedPolicy.project_id.in_(self.visible))
            found.append(or_(and_(row.checkpoint_id.is_(None), row.upload_id.is_(None)), *mine))
        if self.suite_hash is not None:
            found.append(row.suite_hash == self.suite_hash)
        if self.run_id is not None:
            found.append(tables.Run.id == self.run_id)
        return found


class PolicyEvaluationRepository:
    """Reads and writes them within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def get(self, evaluation_id: str, *, whole: bool = False) -> tables.PolicyEvaluation:
        """The evaluation; the `whole` of it with task, episodes and ways.

        Raises:
            NotFoundError: there is none.
        """
        query = select(tables.PolicyEvaluation).where(tables.PolicyEvaluation.id == evaluation_id)
        if whole:
            row = tables.PolicyEvaluation
            query = query.options(undefer(row.task), undefer(row.episodes), undefer(row.ways))
        found = self._session.scalar(query)
        if found is None:
            raise NotFoundError.of("evaluation", evaluation_id)
        return found

    def alike(self, key: str) -> tables.PolicyEvaluation | None:
        """The one of the same policy on the same suite, measured or under way."""
        query = select(tables.PolicyEvaluation).where(
            tables.PolicyEvaluation.key == key, tables.PolicyEvaluation.error.is_(None)
        )
        return self._session.scalars(query.order_by(tables.PolicyEvaluation.created_at.desc())).first()

    def page(self, window: Window, wanted: "Wanted") -> tuple[Sequence[tuple[tables.PolicyEvaluation, str | None]], int]:
        """Some of them, the newest first, each with its policy's run, and how many there are.

        Their episodes are left in the database.
        """
        row = tables.PolicyEvaluation
        conditions = wanted.conditions()
        counted = _with_run(select(func.count()).select_from(row)).where(*conditions)
        query = _with_run(select(row, tables.Run.id).select_from(row)).where(*conditions)
        query = query.order_by(row.created_at.desc(), row.id).offset(window.offset).limit(window.limit)
        found = [(each[0], each[1]) for each in self._session.execute(query)]
        return found, self._session.scalar(counted) or 0

    def run_of(self, evaluation: tables.PolicyEvaluation) -> str | None:
        """The run that made its policy; None where it is not a run's, or is gone."""
        query = select(tables.Checkpoint.run_id).where(tables.Checkpoint.id == evaluation.checkpoint_id)
        return self._session.scalar(query) if evaluation.checkpoint_id else None

    def measured(self, job_id: str, measurement: Measurement) -> None:
        """What came out of a job."""
        result = measurement.result
        mine = select(tables.PolicyEvaluation).where(tables.PolicyEvaluation.job_id == job_id)
        for evaluation in self._session.scalars(mine):
            trained = evaluation.policy["source"] != "baseline"
            evaluation.suite, evaluation.suite_hash = result.suite, result.suite_hash
            evaluation.figures = figures_of(measurement, trained=trained).model_dump(mode="json")
            evaluation.task = measurement.task.model_dump(mode="json")
            evaluation.episodes = encode_episodes(result.episodes)
            evaluation.ways = packed(measurement)
            evaluation.error = None

    def measured_by(self, job_id: str) -> str | None:
        """Id of an evaluation whose figures came out of a job; None where it is gone."""
        row = tables.PolicyEvaluation
        return self._session.scalars(select(row.id).where(row.job_id == job_id, row.suite.is_not(None))).first()

    def given_up(self, job_id: str, reason: str) -> None:
        """There will be no figures."""
        self._session.execute(
            update(tables.PolicyEvaluation)
            .where(tables.PolicyEvaluation.job_id == job_id, tables.PolicyEvaluation.suite.is_(None))
            .values(error=reason)
            .execution_options(synchronize_session=False)
        )


def _with_run(query: _Query) -> _Query:
    """With the run and the experiment of each evaluation's policy, or with the upload, where there are any."""
    joined = query.outerjoin(tables.Checkpoint, tables.Checkpoint.id == tables.PolicyEvaluation.checkpoint_id)
    joined = joined.outerjoin(tables.Run, tables.Run.id == tables.Checkpoint.run_id)
    joined = joined.outerjoin(tables.Experiment, tables.Experiment.id == tables.Run.experiment_id)
    return joined.outerjoin(tables.UploadedPolicy, tables.UploadedPolicy.id == tables.PolicyEvaluation.upload_id)


def encode_episodes(episodes: tuple[EpisodeResult, ...]) -> bytes:
    """Episodes as the database keeps them."""
    return zlib.compress(_EPISODES.dump_json(episodes))


def episodes_of(evaluation: tables.PolicyEvaluation) -> tuple[EpisodeResult, ...]:
    """Its episodes, in the suite's order; none before it is measured."""
    return _EPISODES.validate_json(zlib.decompress(evaluation.episodes)) if evaluation.episodes else ()
