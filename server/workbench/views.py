"""Named views of the table of trainings."""

from server.services import Services
from server.workbench.marks import ViewRepository
from server.workbench.schemas import SavedView, SavedViewEdit, SavedViews


class ViewService:
    """Lists, saves and removes views."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def all(self) -> SavedViews:
        """By name."""
        with self._services.database.read() as session:
            return SavedViews(
                items=[
                    SavedView(id=view.id, name=view.name, address=view.address, created_at=view.created_at)
                    for view in ViewRepository(session).all()
                ]
            )

    def save(self, edit: SavedViewEdit) -> SavedViews:
        """Keep a view; one of that name is replaced.

        Raises:
            ConflictError: there are too many.
        """
        with self._services.database.write() as session:
            ViewRepository(session).save(edit.name, edit.address)
        return self.all()

    def remove(self, view_id: str) -> None:
        """Forget a view.

        Raises:
            NotFoundError: there is none.
        """
        with self._services.database.write() as session:
            ViewRepository(session).remove(view_id)
