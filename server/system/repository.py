"""Workers that have been heard of, in SQL."""

from collections.abc import Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from server.database import tables
from server.runs.states import ACTIVE
from workers.protocol import Queue


class WorkerRepository:
    """Reads and writes workers within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def seen_since(self, moment: float) -> Sequence[tables.Worker]:
        """The workers heard of since `moment` (seconds since the epoch), by name."""
        query = select(tables.Worker).where(tables.Worker.last_seen >= moment).order_by(tables.Worker.name)
        return self._session.scalars(query).all()

    def seen(self, name: str, queue: Queue, moment: float) -> None:
        """Note that a worker of this queue has just been heard of."""
        self._session.merge(tables.Worker(name=name, queue=queue, last_seen=moment))

    def idle_by_queue(self, since: float, until: float) -> dict[Queue, int]:
        """How many workers heard of between these moments train nothing, by queue; a queue without any is absent.

        One heard of in the future was heard before the clock was set back, and not since.
        """
        busy = select(tables.Run.worker).where(tables.Run.state.in_(ACTIVE), tables.Run.worker.is_not(None))
        query = (
            select(tables.Worker.queue, func.count())
            .where(tables.Worker.last_seen.between(since, until), tables.Worker.name.not_in(busy))
            .group_by(tables.Worker.queue)
        )
        return {row[0]: row[1] for row in self._session.execute(query)}
