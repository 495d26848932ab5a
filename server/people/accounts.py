"""What people may do with their own account: password, browsers, tokens for programs."""

import time

from server.audit.repository import AuditRepository
from server.database import tables
from server.errors import ConflictError, InvalidRequestError, NotFoundError
from server.ids import new_id
from server.people.passwords import hash_password, is_password
from server.people.repository import CredentialRepository, PeopleRepository
from server.people.schemas import Account, ApiToken, ApiTokenCreate, NewApiToken, PasswordChange, Session
from server.people.secret import API_PREFIX, hash_of, new_secret
from server.security.principal import Principal
from server.services import Services

_DAY = 24 * 3600.0
_MAX_TOKENS = 50


class AccountService:
    """An account, for whom it belongs to."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def get(self, principal: Principal) -> Account:
        """Who asks."""
        with self._services.database.read() as session:
            people = PeopleRepository(session)
            user = people.get(principal.user_id) if principal.user_id is not None else None
            return Account(
                kind="owner" if principal.kind == "owner" else "token" if principal.kind == "token" else "person",
                name=principal.name,
                email=user.email if user else None,
                administrates=principal.administrates,
                people=people.any(),
                connected=user is not None and user.subject is not None,
                has_password=user is not None and user.password_hash is not None,
                may_launch=principal.has_anywhere("editor"),
            )

    def change_password(self, principal: Principal, change: PasswordChange) -> None:
        """Set a new password, and sign out every other browser.

        Raises:
            ConflictError: the old one is not right, or the account has none.
        """
        user_id, current = _own(principal)
        with self._services.database.read() as session:
            kept = PeopleRepository(session).get(user_id).password_hash
        if not is_password(change.old, kept):
            raise ConflictError("That is not your present password.")
        hashed = hash_password(change.new)
        with self._services.database.write() as session:
            PeopleRepository(session).get(user_id).password_hash = hashed
            CredentialRepository(session).end_sessions(user_id, but=current)
            AuditRepository(session).add("password.changed", target=user_id, name=principal.name)
        self._services.gate.changed()

    def sessions(self, principal: Principal) -> list[Session]:
        """The browsers that are signed in, the newest first."""
        user_id, current = _own(principal)
        with self._services.database.read() as session:
            rows = CredentialRepository(session).sessions(user_id, time.time())
        return [
            Session(
                id=row.id,
                current=row.id == current,
                created_at=row.created_at,
                seen_at=row.seen_at,
                address=row.address,
                browser=row.browser,
            )
            for row in rows
        ]

    def end_session(self, principal: Principal, session_id: str) -> None:
        """Sign a browser out.

        Raises:
            NotFoundError: it is none of theirs.
        """
        user_id, _ = _own(principal)
        with self._services.database.write() as session:
            if not CredentialRepository(session).end_sessions(user_id, only=session_id):
                raise NotFoundError.of("session", session_id)
            AuditRepository(session).add("session.ended", target=session_id, name=principal.name)
        self._services.gate.changed()

    def tokens(self, principal: Principal) -> list[ApiToken]:
        """The tokens for programs, the newest first."""
        user_id, _ = _own(principal)
        with self._services.database.read() as session:
            return [_token_view(row) for row in CredentialRepository(session).api_tokens(user_id)]

    def make_token(self, principal: Principal, request: ApiTokenCreate) -> NewApiToken:
        """A new token for programs.

        Raises:
            NotFoundError: a project may not be seen.
            ConflictError: there are too many already.
        """
        user_id, _ = _own(principal)
        for project_id in request.projects or ():
            principal.require("viewer", project_id)
        if request.projects == []:
            raise InvalidRequestError("A token for no project opens nothing: name some, or leave it open for all.")
        secret, now = new_secret(API_PREFIX), time.time()
        row = tables.ApiToken(
            id=new_id(),
            user_id=user_id,
            name=request.name,
            hash=hash_of(secret),
            scope=request.scope,
            projects=list(request.projects) if request.projects is not None else None,
            created_at=now,
            expires_at=None if request.days is None else now + request.days * _DAY,
        )
        with self._services.database.write() as session:
            credentials = CredentialRepository(session)
            if len(credentials.api_tokens(user_id)) >= _MAX_TOKENS:
                raise ConflictError(f"You have {_MAX_TOKENS} tokens already: revoke some.")
            credentials.add(row)
            AuditRepository(session).add("token.made", target=row.id, name=row.name, details=row.scope)
        return NewApiToken(**_token_view(row).model_dump(), token=secret)

    def revoke_token(self, principal: Principal, token_id: str) -> None:
        """Let a token open nothing any more.

        Raises:
            NotFoundError: it is none of theirs.
        """
        user_id, _ = _own(principal)
        with self._services.database.write() as session:
            row = CredentialRepository(session).api_token(token_id=token_id)
            if row is None or row.user_id != user_id:
                raise NotFoundError.of("token", token_id)
            row.revoked_at = time.time()
            AuditRepository(session).add("token.revoked", target=row.id, name=row.name)
        self._services.gate.changed()


def _own(principal: Principal) -> tuple[str, str]:
    """Account and session."""
    assert principal.user_id is not None
    assert principal.credential is not None
    return principal.user_id, principal.credential


def _token_view(row: tables.ApiToken) -> ApiToken:
    return ApiToken(
        id=row.id,
        name=row.name,
        scope=row.scope,
        projects=row.projects,
        created_at=row.created_at,
        expires_at=row.expires_at,
        seen_at=row.seen_at,
    )
