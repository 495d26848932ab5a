"""The audit log in SQL."""

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import ColumnElement, func, select
from sqlalchemy.orm import Session

from server.audit.actor import current_actor
from server.database import tables
from server.http.paging import Window


@dataclass(frozen=True)
class AuditFilter:
    """Which entries are wanted: all that apply; None applies to all.

    Attributes:
        actor: a name.
        action: as KIND.DEED, or a KIND alone.
        target: id of what it was done to.
        project_id: where.
        since: seconds since the epoch, included.
        until: likewise, not included.
    """

    actor: str | None = None
    action: str | None = None
    target: str | None = None
    project_id: str | None = None
    since: float | None = None
    until: float | None = None


class AuditRepository:
    """Adds to the log within the caller's transaction, so that a deed and its entry are kept or lost together."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(
        self,
        action: str,
        *,
        target: str | None = None,
        name: str | None = None,
        project_id: str | None = None,
        details: str | None = None,
    ) -> None:
        """Note what whoever acts has done."""
        actor = current_actor()
        self._session.add(
            tables.AuditEntry(
                actor=actor.principal.name,
                user_id=actor.principal.user_id,
                address=actor.address[:64],
                action=action,
                target=target,
                name=name,
                project_id=project_id,
                details=details,
            )
        )

    def page(self, wanted: AuditFilter, window: Window) -> tuple[Sequence[tables.AuditEntry], int]:
        """Entries, the newest first, and how many there are in all."""
        conditions = _conditions(wanted)
        total = self._session.scalar(select(func.count()).select_from(tables.AuditEntry).where(*conditions)) or 0
        query = select(tables.AuditEntry).where(*conditions).order_by(tables.AuditEntry.id.desc())
        return self._session.scalars(query.limit(window.limit).offset(window.offset)).all(), total

    def before(self, wanted: AuditFilter, entry_id: int | None, limit: int) -> Sequence[tables.AuditEntry]:
        """The newest `limit` entries older than one of them."""
        query = select(tables.AuditEntry).where(*_conditions(wanted)).order_by(tables.AuditEntry.id.desc()).limit(limit)
        if entry_id is not None:
            query = query.where(tables.AuditEntry.id < entry_id)
        return self._session.scalars(query).all()


def _conditions(wanted: AuditFilter) -> list[ColumnElement[bool]]:
    entry = tables.AuditEntry
    conditions: list[ColumnElement[bool]] = []
    if wanted.actor is not None:
        conditions.append(entry.actor == wanted.actor)
    if wanted.action is not None:
        conditions.append(
            entry.action == wanted.action
            if "." in wanted.action
            else entry.action.startswith(f"{wanted.action}.", autoescape=True)
        )
    if wanted.target is not None:
        conditions.append(entry.target == wanted.target)
    if wanted.project_id is not None:
        conditions.append(entry.project_id == wanted.project_id)
    if wanted.since is not None:
        conditions.append(entry.at >= wanted.since)
    if wanted.until is not None:
        conditions.append(entry.at < wanted.until)
    return conditions
