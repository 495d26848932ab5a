"""Evaluations that people asked for, in SQL."""

import zlib
from collections.abc import Sequence

from pydantic import TypeAdapter
from sqlalchemy import func, select, update
from sqlalchemy.orm import Session, undefer

from server.database import tables
from server.errors import NotFoundError
from server.paging import Window
from workers.reporting import EpisodeResult, EvaluationResult
from workers.shipped.figures import figures

_EPISODES = TypeAdapter(tuple[EpisodeResult, ...])


class PolicyEvaluationRepository:
    """Reads and writes them within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def get(self, evaluation_id: str, *, with_episodes: bool = False) -> tables.PolicyEvaluation:
        """The evaluation.

        Raises:
            NotFoundError: there is none.
        """
        query = select(tables.PolicyEvaluation).where(tables.PolicyEvaluation.id == evaluation_id)
        if with_episodes:
            query = query.options(undefer(tables.PolicyEvaluation.episodes))
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

    def page(self, window: Window) -> tuple[Sequence[tables.PolicyEvaluation], int]:
        """Some of them, the newest first, and how many there are; their episodes are left in the database."""
        query = select(tables.PolicyEvaluation).order_by(
            tables.PolicyEvaluation.created_at.desc(), tables.PolicyEvaluation.id
        )
        total = self._session.scalar(select(func.count()).select_from(tables.PolicyEvaluation)) or 0
        return self._session.scalars(query.offset(window.offset).limit(window.limit)).all(), total

    def measured(self, job_id: str, result: EvaluationResult) -> None:
        """What came out of a job."""
        mine = select(tables.PolicyEvaluation).where(tables.PolicyEvaluation.job_id == job_id)
        for evaluation in self._session.scalars(mine):
            evaluation.suite, evaluation.suite_hash = result.suite, result.suite_hash
            evaluation.figures = figures(result.episodes, evaluation.arrival_distance).model_dump(mode="json")
            evaluation.episodes = zlib.compress(_EPISODES.dump_json(result.episodes))
            evaluation.error = None

    def given_up(self, job_id: str, reason: str) -> None:
        """There will be no figures."""
        self._session.execute(
            update(tables.PolicyEvaluation)
            .where(tables.PolicyEvaluation.job_id == job_id, tables.PolicyEvaluation.suite.is_(None))
            .values(error=reason)
            .execution_options(synchronize_session=False)
        )


def episodes_of(evaluation: tables.PolicyEvaluation) -> tuple[EpisodeResult, ...]:
    """Its episodes, in the suite's order; none before it is measured."""
    return _EPISODES.validate_json(zlib.decompress(evaluation.episodes)) if evaluation.episodes else ()
