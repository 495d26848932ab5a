"""Signing in with name and password, and out."""

import time

from sqlalchemy.orm import Session

from server.audit.actor import Actor, acting, current_actor
from server.audit.repository import AuditRepository
from server.database import tables
from server.errors import UnauthorizedError
from server.ids import new_id
from server.people.passwords import is_password
from server.people.repository import CredentialRepository, PeopleRepository
from server.people.secret import hash_of, new_secret
from server.security.principal import Principal
from server.services import Services

_THIRTY_DAYS = 30 * 24 * 3600.0


class SignInService:
    """Opens and closes sessions."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def has_people(self) -> bool:
        """Whether there are accounts."""
        with self._services.database.read() as session:
            return PeopleRepository(session).any()

    def sign_in(self, name: str, password: str, browser: str) -> str:
        """The secret of a new session.

        Raises:
            UnauthorizedError: no such person, or not their password; which of both is told by nothing, the time included.
        """
        with self._services.database.read() as session:
            user = PeopleRepository(session).named(name)
        kept = user.password_hash if user is not None and user.disabled_at is None else None
        if not is_password(password, kept) or user is None:
            raise UnauthorizedError("There is no such name with this password.")
        with self._services.database.write() as session:
            return open_session(session, user, browser)

    def sign_out(self, principal: Principal) -> None:
        """End the session."""
        if principal.kind != "person" or principal.user_id is None or principal.credential is None:
            return
        with self._services.database.write() as session:
            CredentialRepository(session).end_sessions(principal.user_id, only=principal.credential)
            AuditRepository(session).add("person.signed_out", target=principal.user_id, name=principal.name)
        self._services.gate.changed()


def open_session(session: Session, user: tables.User, browser: str) -> str:
    """Sign somebody in within the caller's transaction; the session's secret, whose hash alone is kept."""
    secret, now = new_secret(), time.time()
    credentials = CredentialRepository(session)
    credentials.sweep(now)
    row = tables.LoginSession(
        id=new_id(),
        user_id=user.id,
        hash=hash_of(secret),
        expires_at=now + _THIRTY_DAYS,
        address=current_actor().address[:64],
        browser=browser[:200],
    )
    credentials.add(row)
    with acting(Actor(Principal("person", user.name, user_id=user.id), current_actor().address)):
        AuditRepository(session).add("person.signed_in", target=user.id, name=user.name)
    return secret
