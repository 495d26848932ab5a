"""Workers that have been heard of, in SQL."""

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from server import models


class WorkerRepository:
    """Reads and writes workers within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def seen_since(self, moment: float) -> Sequence[models.Worker]:
        """The workers heard of since `moment` (seconds since the epoch), by name."""
        query = select(models.Worker).where(models.Worker.last_seen >= moment).order_by(models.Worker.name)
        return self._session.scalars(query).all()

    def seen(self, name: str, moment: float) -> None:
        """Note that a worker has just been heard of."""
        self._session.merge(models.Worker(name=name, last_seen=moment))
