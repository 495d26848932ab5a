"""Whose secret it is: sessions, tokens and workers' tokens, looked up once and remembered for some seconds."""

import asyncio
import contextlib
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from sqlalchemy import update
from sqlalchemy.orm import Session

from server.database import tables
from server.database.engine import Database
from server.database.tables import Role, TokenScope
from server.lanes import Lane
from server.outage import patiently
from server.people.repository import CredentialRepository, PeopleRepository
from server.people.secret import hash_of, new_secret
from server.security.principal import Principal, capped

# Changes made here are known at once; those that a command makes in the database beside the server, after so many seconds.
_REMEMBERED_SECONDS = 5.0
_MAX_REMEMBERED = 10_000
# Who holds a stream open is asked for anew so often.
_ASK_AGAIN_SECONDS = 60.0
# "Last used" is noted no more often.
_SEEN_SECONDS = 600.0
# A session's secret is exchanged daily; requests that were under way bring the one before.
_ROTATE_SECONDS = 24 * 3600.0
_GRACE_SECONDS = 120.0


@dataclass(frozen=True, slots=True)
class _Known:
    principal: Principal | None
    until: float
    rotate_after: float


class Gate:
    """Tells who brings a secret. Used on the event loop; the database is asked on threads of a lane.

    Args:
        database: that knows the people.
        lane: to ask it on.
    """

    def __init__(self, database: Database, lane: Lane) -> None:
        self._database = database
        self._lane = lane
        self._lock = threading.Lock()
        self._known: OrderedDict[str, _Known] = OrderedDict()
        self._changes = 0
        self._waiting: dict[asyncio.Event, asyncio.AbstractEventLoop] = {}

    async def browser(self, secret: str, *, may_rotate: bool) -> tuple[Principal | None, str | None]:
        """Who signed in with this browser, and the new secret where the old one has served for long enough."""
        known = await self._ask(f"session {hash_of(secret)}", self._session, hash_of(secret))
        if known.principal is None or not may_rotate or time.time() < known.rotate_after:
            return known.principal, None
        return known.principal, await self._lane.run(self._rotate, known.principal.credential or "", hash_of(secret))

    async def token(self, secret: str) -> Principal | None:
        """Whose token for programs it is."""
        return (await self._ask(f"token {hash_of(secret)}", self._token, hash_of(secret))).principal

    async def worker(self, secret: str) -> Principal | None:
        """Which workers' token it is."""
        return (await self._ask(f"worker {hash_of(secret)}", self._worker, hash_of(secret))).principal

    def changed(self) -> None:
        """Forget everything: somebody's rights have changed. After the commit; from any thread."""
        with self._lock:
            self._changes += 1
            self._known.clear()
            waiting = list(self._waiting.items())
        for event, loop in waiting:
            if not loop.is_closed():
                loop.call_soon_threadsafe(event.set)

    async def until_changed(self, principal: Principal) -> None:
        """Wait until somebody who holds a stream open may not do what they might when they opened it.

        Who holds a token of the installation itself is waited for without an end.
        """
        again = {"person": self._session, "token": self._token, "worker": self._worker}.get(principal.kind)
        event = asyncio.Event()
        with self._lock:
            self._waiting[event] = asyncio.get_running_loop()
        try:
            while True:
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(event.wait(), None if principal.credential is None else _ASK_AGAIN_SECONDS)
                event.clear()
                if again is not None and principal.credential is not None:
                    known = await patiently(partial(self._lane.run, again, None, principal.credential))
                    if known.principal != principal:
                        return
        finally:
            with self._lock:
                del self._waiting[event]

    async def _ask(self, key: str, look: Callable[[str], _Known], hashed: str) -> _Known:
        with self._lock:
            known, changes = self._known.get(key), self._changes
        if known is not None and known.until > time.monotonic():
            return known
        known = await self._lane.run(look, hashed)
        with self._lock:
            # What was read before a change may be wrong after it.
            if changes == self._changes:
                self._known[key] = known
                self._known.move_to_end(key)
                if len(self._known) > _MAX_REMEMBERED:
                    self._known.popitem(last=False)
        return known

    def _session(self, hashed: str | None, session_id: str | None = None) -> _Known:
        now = time.time()
        with self._database.read() as session:
            row = CredentialRepository(session).session(hashed=hashed, session_id=session_id)
            if row is None or row.expires_at <= now or (hashed == row.previous_hash and _too_old(row, now)):
                return _known(None)
            principal = principal_of_account("person", session, row.user_id, row.id, "admin", None)
        if principal is not None and row.seen_at < now - _SEEN_SECONDS:
            self._seen(tables.LoginSession, row.id, now)
        # Who brings the secret before has been given the new one by another answer.
        is_newest = hashed == row.hash
        return _known(principal, row.rotated_at + _ROTATE_SECONDS if is_newest else float("inf"))

    def _token(self, hashed: str | None, token_id: str | None = None) -> _Known:
        now = time.time()
        with self._database.read() as session:
            row = CredentialRepository(session).api_token(hashed=hashed, token_id=token_id)
            if row is None or (row.expires_at is not None and row.expires_at <= now):
                return _known(None)
            principal = principal_of_account("token", session, row.user_id, row.id, row.scope, row.projects)
        if principal is not None and (row.seen_at is None or row.seen_at < now - _SEEN_SECONDS):
            self._seen(tables.ApiToken, row.id, now)
        return _known(principal)

    def _worker(self, hashed: str | None, token_id: str | None = None) -> _Known:
        now = time.time()
        with self._database.read() as session:
            row = CredentialRepository(session).worker_token(hashed=hashed, token_id=token_id)
        if row is None:
            return _known(None)
        if row.seen_at is None or row.seen_at < now - _SEEN_SECONDS:
            self._seen(tables.WorkerToken, row.id, now)
        return _known(Principal("worker", row.name, credential=row.id))

    def _seen(
        self, table: type[tables.LoginSession | tables.ApiToken | tables.WorkerToken], identifier: str, now: float
    ) -> None:
        with self._database.write() as session:
            session.execute(update(table).where(table.id == identifier).values(seen_at=now))

    def _rotate(self, session_id: str, old: str) -> str | None:
        new = new_secret()
        with self._database.write() as session:
            rotated = CredentialRepository(session).rotate(session_id, old, hash_of(new), time.time())
        with self._lock:
            self._known.pop(f"session {old}", None)
        return new if rotated else None


def _too_old(row: tables.LoginSession, now: float) -> bool:
    return row.rotated_at < now - _GRACE_SECONDS


def _known(principal: Principal | None, rotate_after: float = float("inf")) -> _Known:
    return _Known(principal, time.monotonic() + _REMEMBERED_SECONDS, rotate_after)


def principal_of_account(
    kind: str, session: Session, user_id: str, credential: str, scope: TokenScope, projects: list[str] | None
) -> Principal | None:
    """What an account may do, within a token's scope and projects; None where it is closed."""
    people = PeopleRepository(session)
    user = people.get(user_id)
    if user.disabled_at is not None:
        return None
    everywhere: Role | None = capped("admin", scope) if user.admin and projects is None else None
    roles: dict[str, Role] = {}
    if everywhere is None:
        own: dict[str, Role] = {project: role for _, project, _, role in people.roles([user_id])}
        if user.admin:
            own = dict.fromkeys(projects or (), "admin")
        roles = {project: capped(role, scope) for project, role in own.items() if projects is None or project in projects}
    return Principal(
        "token" if kind == "token" else "person",
        user.name,
        user_id=user.id,
        credential=credential,
        administrates=user.admin and scope == "admin" and projects is None,
        everywhere=everywhere,
        roles=roles,
    )
