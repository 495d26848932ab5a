"""Robots' recordings in SQL."""

from collections.abc import Collection, Sequence

from sqlalchemy import func, select, true
from sqlalchemy.orm import Session

from server.database import tables
from server.errors import NotFoundError
from server.http.paging import Window


class BagRepository:
    """Reads and writes them within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, bag: tables.Bag) -> None:
        """Add one."""
        self._session.add(bag)

    def count(self) -> int:
        """How many there are."""
        return self._session.scalar(select(func.count()).select_from(tables.Bag)) or 0

    def get(self, bag_id: str) -> tables.Bag:
        """The recording, its file left in the database.

        Raises:
            NotFoundError: there is none.
        """
        found = self._session.get(tables.Bag, bag_id)
        if found is None:
            raise NotFoundError.of("recording", bag_id)
        return found

    def page(self, window: Window, visible: Collection[str] | None) -> tuple[Sequence[tables.Bag], int]:
        """Some of them, the newest first, and how many there are in the `visible` projects (None: all)."""
        row = tables.Bag
        seen = row.project_id.in_(visible) if visible is not None else true()
        total = self._session.scalar(select(func.count()).select_from(row).where(seen)) or 0
        query = select(row).where(seen).order_by(row.created_at.desc(), row.id)
        return self._session.scalars(query.offset(window.offset).limit(window.limit)).all(), total

    def delete(self, bag_id: str) -> None:
        """Remove one.

        Raises:
            NotFoundError: there is none.
        """
        self._session.delete(self.get(bag_id))
