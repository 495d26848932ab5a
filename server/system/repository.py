"""Workers that have been heard of, in SQL."""

from collections.abc import Collection, Sequence

from sqlalchemy import ColumnElement, func, select, update
from sqlalchemy.orm import Session

from server.database import tables
from server.runs.states import ACTIVE
from workers.protocol import HEARTBEAT_SECONDS, Queue

SILENCE_SECONDS = 3 * HEARTBEAT_SECONDS
"""A worker that was silent for longer is not counted on."""


class WorkerRepository:
    """Reads and writes workers within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def seen_since(self, moment: float) -> Sequence[tables.Worker]:
        """The workers heard of since `moment` (seconds since the epoch), by name."""
        query = select(tables.Worker).where(tables.Worker.last_seen >= moment).order_by(tables.Worker.name)
        return self._session.scalars(query).all()

    def seen(self, name: str, queue: Queue, moment: float, trouble: str | None = None) -> None:
        """Note that a worker of this queue has just been heard of, and why it takes up no run where it does not."""
        self._session.merge(tables.Worker(name=name, queue=queue, last_seen=moment, trouble=trouble))

    def drain(self, names: Collection[str], moment: float | None) -> None:
        """Ask workers to finish their runs and take up no more; None takes it back."""
        self._session.execute(update(tables.Worker).where(tables.Worker.name.in_(names)).values(drained_at=moment))

    def is_drained(self, name: str) -> bool:
        """Whether this worker was asked to take up no more."""
        query = select(tables.Worker.drained_at).where(tables.Worker.name == name)
        return self._session.scalar(query) is not None

    def fit(self, queues: Collection[Queue], since: float, until: float) -> Sequence[str]:
        """The workers of these queues that were heard of between these moments and take up runs."""
        return self._session.scalars(
            select(tables.Worker.name).where(tables.Worker.queue.in_(queues), *_there(since, until))
        ).all()

    def idle_by_queue(self, since: float, until: float) -> dict[Queue, int]:
        """How many workers heard of between these moments could take up a run, by queue; a queue without any is absent.

        One heard of in the future was heard before the clock was set back, and not since.
        """
        busy = select(tables.Run.worker).where(tables.Run.state.in_(ACTIVE), tables.Run.worker.is_not(None))
        query = (
            select(tables.Worker.queue, func.count())
            .where(*_there(since, until), tables.Worker.name.not_in(busy))
            .group_by(tables.Worker.queue)
        )
        return {row[0]: row[1] for row in self._session.execute(query)}


def _there(since: float, until: float) -> tuple[ColumnElement[bool], ...]:
    return tables.Worker.last_seen.between(since, until), tables.Worker.trouble.is_(None), tables.Worker.drained_at.is_(None)
