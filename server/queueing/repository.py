"""What the queue and the workers are made of, in SQL."""

from collections.abc import Collection, Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session, joinedload

from server.database import tables
from server.runs.states import ACTIVE
from server.runs.views import SPEED
from workers.protocol import Queue

# Of the runs that workers took up last: their rates, whether they still run or not.
_RECENT = 20
# That a worker is gone is noticed a lease later.
_AFTERWARDS_SECONDS = 60.0


class QueueRepository:
    """Reads within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def workers(self) -> Sequence[tables.Worker]:
        """All that are known, by name."""
        return self._session.scalars(select(tables.Worker).order_by(tables.Worker.name)).all()

    def active(self) -> Sequence[tables.Run]:
        """The runs that workers have, with their experiments."""
        query = select(tables.Run).where(tables.Run.state.in_(ACTIVE)).options(joinedload(tables.Run.experiment))
        return self._session.scalars(query).all()

    def recent_speeds(self) -> list[tuple[Queue, float]]:
        """Steps a second of the runs that workers had last, with the queue of each."""
        recent = (
            select(tables.Worker.queue, tables.LatestMetric.value)
            .join(tables.Run, tables.Run.id == tables.Worker.last_run_id)
            .join(tables.LatestMetric, tables.LatestMetric.run_id == tables.Run.id)
            .where(tables.LatestMetric.name == SPEED, tables.LatestMetric.value > 0.0)
            .order_by(tables.Run.state.in_(ACTIVE).desc(), tables.Run.finished_at.desc(), tables.Run.id)
            .limit(_RECENT)
        )
        return [(queue, value) for queue, value in self._session.execute(recent)]

    def last_words(self, workers: Collection[str], visible: Collection[str] | None) -> dict[str, str]:
        """By worker the newest line in the log of the run that it had last."""
        event = tables.RunEvent
        last = select(tables.Worker.name, func.max(event.id)).join(event, event.run_id == tables.Worker.last_run_id)
        # What others have done with the run later are not its words.
        last = last.where(tables.Worker.name.in_(workers), event.at <= tables.Worker.last_seen + _AFTERWARDS_SECONDS)
        if visible is not None:
            last = last.join(tables.Run, tables.Run.id == event.run_id).join(tables.Experiment)
            last = last.where(tables.Experiment.project_id.in_(visible))
        last = last.group_by(tables.Worker.name)
        ids = {event_id: worker for worker, event_id in self._session.execute(last)}
        events = self._session.scalars(select(tables.RunEvent).where(tables.RunEvent.id.in_(ids)))
        return {ids[event.id]: event.message for event in events}
