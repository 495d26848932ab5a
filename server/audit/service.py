"""What an administrator may see of what was done."""

from collections.abc import Iterator

from server.audit.repository import AuditFilter, AuditRepository
from server.audit.schemas import AuditEntry
from server.database import tables
from server.http.paging import Window
from server.schemas import Page
from server.services import Services
from server.spreadsheets import csv_rows

_BLOCK = 1_000


class AuditService:
    """Reads the log."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def page(self, wanted: AuditFilter, window: Window) -> Page[AuditEntry]:
        """Entries, the newest first."""
        with self._services.database.read() as session:
            found, total = AuditRepository(session).page(wanted, window)
            return Page(items=[_view(entry) for entry in found], total=total)

    def csv(self, wanted: AuditFilter) -> Iterator[bytes]:
        """All entries as CSV with a heading, the newest first, block by block: each is a transaction of its own."""
        yield csv_rows([tuple(AuditEntry.model_fields)])
        last: int | None = None
        while True:
            with self._services.database.read() as session:
                found = AuditRepository(session).before(wanted, last, _BLOCK)
            if not found:
                return
            last = found[-1].id
            yield csv_rows([tuple(_view(entry).model_dump().values()) for entry in found])


def _view(entry: tables.AuditEntry) -> AuditEntry:
    return AuditEntry(
        id=entry.id,
        at=entry.at,
        actor=entry.actor,
        address=entry.address,
        action=entry.action,
        target=entry.target,
        name=entry.name,
        project_id=entry.project_id,
        details=entry.details,
    )
