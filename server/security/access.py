"""Who may send a request: right Host, no foreign page, and a valid token; decided before anything else looks at it.

- *Host* must be one of ours: a foreign name that resolves to this machine (DNS rebinding) is refused.
- *Origin*, where a browser sends one with a request that changes something or opens a WebSocket, must be the page's own.
- Everything under /api, /live and /replays, and /metrics, need a login: the server's own token, as a cookie or as
  `Authorization: Bearer`, a session's cookie, or a person's token for programs (/metrics takes a token of its own as well).
  /api/worker needs a workers' token instead, which opens nothing else. The pages themselves, /healthz, /readyz and the
  ways to log in are open.

What each of them may do is decided by the routes' permissions (`server.security.permissions`).
"""

import hmac
import ipaddress
from urllib.parse import urlsplit

from starlette.datastructures import URL, MutableHeaders
from starlette.requests import HTTPConnection, Request
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from server.audit.actor import Actor, acting
from server.errors import ForbiddenError, InvalidRequestError, PartAwayError, ServiceError, UnauthorizedError
from server.http.problems import close_for_now, error_response
from server.people.gate import Gate
from server.people.secret import API_PREFIX, WORKER_PREFIX
from server.security.cookies import cookie_name, session_cookie, session_cookie_name, set_login_cookie
from server.security.limits import GuessLimiter
from server.security.principal import ANONYMOUS, OWNER, SCRAPER, WORKER, Principal, set_principal
from server.security.secrets import Secrets
from server.settings import Settings

_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
_LOCAL_NAMES = frozenset({"localhost"})
_WORKER_PREFIX = "/api/worker/"
_PROTECTED_PREFIXES = ("/api/", "/live/", "/replays/")
_METRICS_PATH = "/metrics"
OPEN_PATHS = frozenset(
    {
        "/api/login",
        "/api/sign-in",
        "/api/sign-in/provider",
        "/api/sign-in/provider/callback",
        "/api/invitations/look",
        "/api/invitations/accept",
    }
)
"""Of the API: where one comes to log in."""
# RFC 6455: the request violates the server's policy; browsers see the handshake refused with 403.
_POLICY_VIOLATION = 1008


class AccessMiddleware:
    """Refuses what may not come in; the rest passes on unchanged."""

    def __init__(self, app: ASGIApp, *, settings: Settings, secrets: Secrets, limiter: GuessLimiter, gate: Gate) -> None:
        self._app = app
        self._gate = gate
        self._settings = settings
        self._secrets = secrets
        self._limiter = limiter
        self._metrics_token = settings.metrics_token.get_secret_value() if settings.metrics_token else None
        names = {settings.host, *settings.allowed_hosts, *_LOCAL_NAMES}
        for url in (settings.server_url, settings.public_url):
            if url:
                names.add(urlsplit(url).hostname or "")
        self._host_names = {name.lower() for name in names}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, or answer at once."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        try:
            self._check_host(connection)
            _check_address(scope)
            self._check_origin(connection)
            if scope["type"] == "http" and "token" in connection.query_params and not _is_protected(scope["path"]):
                await self._login_by_url(connection, scope, receive, send)
                return
            principal, renewed = ANONYMOUS, None
            if _is_protected(scope["path"]):
                principal, renewed = await self._identify(connection)
        except ServiceError as error:
            await _refuse(error, scope, receive, send)
            return
        set_principal(connection, principal)
        if renewed is not None:
            send = _with_cookie(send, session_cookie(connection, self._settings, renewed))
        with acting(Actor(principal, connection.client.host if connection.client else "")):
            await self._app(scope, receive, send)

    def _check_host(self, connection: HTTPConnection) -> None:
        try:
            name = urlsplit(f"//{connection.headers.get('host', '')}").hostname or ""
        except ValueError:
            name = ""
        if name in self._host_names or _is_address(name):
            return
        raise InvalidRequestError(
            f"This server does not go by the name {name!r}. If it should, add it to MAPLESS_ALLOWED_HOSTS."
        )

    def _check_origin(self, connection: HTTPConnection) -> None:
        changes = connection.scope["type"] == "websocket" or connection.scope["method"] not in _SAFE_METHODS
        origin = connection.headers.get("origin")
        # Browsers always send an Origin along; programs don't, and have no cookie that could be abused.
        if not changes or origin is None:
            return
        try:
            site = urlsplit(origin).netloc.lower()
        except ValueError:
            site = ""
        if site != connection.headers.get("host", "").lower():
            raise ForbiddenError("This request comes from another site's page.")

    async def _identify(self, connection: HTTPConnection) -> tuple[Principal, str | None]:
        """Who sends it, and the new secret of a session whose old one has served for long enough.

        Raises:
            UnauthorizedError: nobody who is known, and the address is not open to everybody.
            ForbiddenError: a token that opens other addresses only.
            TooManyAttemptsError: too many guesses from there.
        """
        path: str = connection.scope["path"]
        bearer = _bearer(connection)
        if path.startswith(_WORKER_PREFIX):
            return await self._worker(connection, bearer), None
        if path == _METRICS_PATH and self._metrics_token is not None and _equal(bearer, self._metrics_token):
            return SCRAPER, None
        cookie = connection.cookies.get(cookie_name(self._settings))
        if _equal(cookie, self._secrets.cookie):
            return OWNER, None
        session = connection.cookies.get(session_cookie_name(self._settings))
        if session is not None:
            # The answer of a socket has no cookie; the player's and the live view's pages are none of the API.
            may_rotate = connection.scope["type"] == "http" and path.startswith("/api/")
            person, renewed = await self._gate.browser(session, may_rotate=may_rotate)
            if person is not None:
                return person, renewed
        if path in OPEN_PATHS:
            return ANONYMOUS, None
        if bearer is not None and bearer.startswith(API_PREFIX):
            # Too long to be guessed: the right one is let in at once.
            program = await self._gate.token(bearer)
            if program is not None:
                return program, None
        elif bearer is not None:
            await self._limiter.turn(connection)
        if _equal(bearer, self._secrets.token):
            return OWNER, None
        if _equal(bearer, self._secrets.worker_token) or (
            bearer is not None and bearer.startswith(WORKER_PREFIX) and await self._gate.worker(bearer) is not None
        ):
            raise ForbiddenError("The workers' token opens the worker API only.")
        self._count(connection, bearer)
        for stale in (cookie, session):
            if stale is not None:
                self._limiter.failed(connection, stale, once=True)
        raise UnauthorizedError("Log in first: open the URL that the server printed at start, or sign in.")

    async def _worker(self, connection: HTTPConnection, bearer: str | None) -> Principal:
        if _equal(bearer, self._secrets.worker_token):
            return WORKER
        if bearer is not None and bearer.startswith(WORKER_PREFIX):
            worker = await self._gate.worker(bearer)
            if worker is not None:
                return worker
        self._count(connection, bearer)
        raise UnauthorizedError(
            "This needs the workers' token: set MAPLESS_WORKER_TOKEN to the server's, or to one of your own."
        )

    def _count(self, connection: HTTPConnection, wrong: str | None) -> None:
        """Who brings nothing has not guessed."""
        if wrong is not None:
            self._limiter.failed(connection, wrong)

    async def _login_by_url(self, connection: HTTPConnection, scope: Scope, receive: Receive, send: Send) -> None:
        """Set the cookie and go to the same page without the token, so that it stays in no history."""
        token = connection.query_params["token"]
        await self._limiter.turn(connection)
        if not _equal(token, self._secrets.token):
            self._limiter.failed(connection, token)
            raise UnauthorizedError("Wrong token: open the URL that the server printed at its last start.")
        # Path and query only: the place to go to is never another host.
        url = URL(scope=scope).remove_query_params("token")
        target = "/" + url.path.lstrip("/") + (f"?{url.query}" if url.query else "")
        response = RedirectResponse(target, status_code=303)
        set_login_cookie(response, Request(scope), self._settings, self._secrets)
        await response(scope, receive, send)


def _check_address(scope: Scope) -> None:
    """No name of anything holds a NUL: the file system and PostgreSQL would refuse it with an error of their own."""
    if "\0" in scope["path"] or b"%00" in scope.get("query_string", b"") or b"\0" in scope.get("query_string", b""):
        raise InvalidRequestError("The address holds a NUL character.")


def _is_protected(path: str) -> bool:
    return path.startswith(_PROTECTED_PREFIXES) or path == _METRICS_PATH


def _is_address(name: str) -> bool:
    """Whether `name` is a literal IP address: no name that an attacker owns could have been made to resolve to it."""
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _bearer(connection: HTTPConnection) -> str | None:
    scheme, _, token = connection.headers.get("authorization", "").partition(" ")
    return token.strip() if scheme.lower() == "bearer" else None


def _equal(given: str | None, expected: str) -> bool:
    """In a time that does not tell how much of it is right."""
    return given is not None and hmac.compare_digest(given.encode(errors="surrogateescape"), expected.encode())


def _with_cookie(send: Send, cookie: str) -> Send:
    async def send_with_cookie(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).append("set-cookie", cookie)
        await send(message)

    return send_with_cookie


async def _refuse(error: ServiceError, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket" and isinstance(error, PartAwayError):
        await close_for_now(WebSocket(scope, receive, send), error)
        return
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": _POLICY_VIOLATION, "reason": error.message[:120]})
        return
    await error_response(error)(scope, receive, send)
