"""Tags and named views in SQL."""

from collections.abc import Sequence

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from server.database import tables
from server.errors import ConflictError, NotFoundError
from server.ids import new_id

MAX_VIEWS = 200


class MarkRepository:
    """Reads and writes tags within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def tags(self, experiment_id: str) -> list[str]:
        """Of an experiment, in alphabetical order."""
        table = tables.ExperimentTag
        query = select(table.tag).where(table.experiment_id == experiment_id).order_by(table.tag)
        return list(self._session.scalars(query))

    def add_tag(self, experiment_id: str, tag: str) -> None:
        """Put a tag on an experiment that does not have it."""
        self._session.add(tables.ExperimentTag(experiment_id=experiment_id, tag=tag))

    def remove_tag(self, experiment_id: str, tag: str) -> None:
        """Take a tag off, if it is there."""
        table = tables.ExperimentTag
        self._session.execute(delete(table).where(table.experiment_id == experiment_id, table.tag == tag))


class ViewRepository:
    """Reads and writes named views within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def all(self) -> Sequence[tables.SavedView]:
        """By name."""
        return self._session.scalars(select(tables.SavedView).order_by(tables.SavedView.name)).all()

    def save(self, name: str, address: str) -> None:
        """Keep a view under a name; one of that name is replaced.

        Raises:
            ConflictError: there are too many.
        """
        view = self._session.scalar(select(tables.SavedView).where(tables.SavedView.name == name))
        if view is not None:
            view.address = address
            return
        if (self._session.scalar(select(func.count()).select_from(tables.SavedView)) or 0) >= MAX_VIEWS:
            raise ConflictError(f"There are {MAX_VIEWS} views already: remove one first.")
        self._session.add(tables.SavedView(id=new_id(), name=name, address=address))

    def remove(self, view_id: str) -> None:
        """Forget a view.

        Raises:
            NotFoundError: there is none.
        """
        view = self._session.get(tables.SavedView, view_id)
        if view is None:
            raise NotFoundError.of("view", view_id)
        self._session.delete(view)
