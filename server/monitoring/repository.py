"""What is counted when somebody asks, in SQL: each a single row, or a row for each experiment that has something waiting."""

from sqlalchemy import func, select, text
from sqlalchemy.orm import Session

from server.database import tables

Waiting = tuple[str, int, float]
"""An experiment's id, how many of its runs wait, and since when the first of them (seconds since the epoch)."""


class MonitoringRepository:
    """Counts within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def waiting(self) -> list[Waiting]:
        """The experiments with runs that wait for a worker."""
        run = tables.Run
        query = select(run.experiment_id, func.count(), func.min(run.queued_at)).where(run.state == "queued")
        rows = self._session.execute(query.group_by(run.experiment_id))
        return [(identifier, count, since) for identifier, count, since in rows]

    def store_bytes(self) -> int:
        """The size of all archives that are registered."""
        return int(self._session.scalar(select(func.coalesce(func.sum(tables.Checkpoint.size), 0))) or 0)

    def database_bytes(self) -> int:
        """The size of the database on its disk."""
        if self._session.get_bind().dialect.name == "postgresql":
            return int(self._session.scalar(text("SELECT pg_database_size(current_database())")) or 0)
        pages = self._session.scalar(text("PRAGMA page_count")) or 0
        return int(pages * (self._session.scalar(text("PRAGMA page_size")) or 0))
