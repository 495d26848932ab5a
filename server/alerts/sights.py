"""What alerts are about, in SQL: each question costs what has changed, or what is under way."""

from collections import defaultdict
from collections.abc import Collection, Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session, contains_eager

from server.database import tables
from server.runs.states import ACTIVE

# A study has hundreds of trials, and a page of its own.
_SEEN = tables.Experiment.deleted_at.is_(None), tables.Experiment.study_id.is_(None)


class SightRepository:
    """Reads within the caller's transaction; what lies in the trash, and the trials of studies, are not seen."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def ended_since(self, since: float, limit: int) -> Sequence[tables.Run]:
        """Runs that ended after a moment, with their experiments, the first one first."""
        query = (
            select(tables.Run)
            .join(tables.Run.experiment)
            .options(contains_eager(tables.Run.experiment))
            .where(tables.Run.finished_at > since, *_SEEN)
            .where(tables.Run.state.in_(("completed", "stopped", "failed")))
            .order_by(tables.Run.finished_at)
            .limit(limit)
        )
        return self._session.scalars(query).all()

    def runs_of(self, experiment_ids: Collection[str]) -> dict[str, list[tables.Run]]:
        """All runs of the experiments, by experiment."""
        found: dict[str, list[tables.Run]] = defaultdict(list)
        query = select(tables.Run).where(tables.Run.experiment_id.in_(experiment_ids)).order_by(tables.Run.seed)
        for run in self._session.scalars(query):
            found[run.experiment_id].append(run)
        return found

    def active(self) -> Sequence[tables.Run]:
        """The runs that workers have, with their experiments."""
        query = select(tables.Run).join(tables.Run.experiment).options(contains_eager(tables.Run.experiment))
        return self._session.scalars(query.where(tables.Run.state.in_(ACTIVE), *_SEEN)).all()

    def waiting_since(self, before: float, limit: int) -> list[tuple[tables.Experiment, int, float]]:
        """Experiments with runs that wait since before a moment: how many, and since when the first one."""
        since = func.min(tables.Run.queued_at)
        counted = (
            select(tables.Run.experiment_id, func.count().label("waiting"), since.label("since"))
            .where(tables.Run.state == "queued", tables.Run.queued_at < before)
            .group_by(tables.Run.experiment_id)
            .subquery()
        )
        query = (
            select(tables.Experiment, counted.c.waiting, counted.c.since)
            .join(counted, counted.c.experiment_id == tables.Experiment.id)
            .where(*_SEEN)
            .order_by(counted.c.since)
            .limit(limit)
        )
        return [(row[0], row[1], row[2]) for row in self._session.execute(query)]
