"""The login cookie."""

from starlette.requests import HTTPConnection, Request
from starlette.responses import Response

from server.security.secrets import Secrets
from server.settings import Settings

_THIRTY_DAYS = 30 * 24 * 3600
_JOURNEY_PATH = "/api/sign-in/provider"


def cookie_name(settings: Settings) -> str:
    """Cookies are shared by all ports of a host; with the port in its name, two installations don't log each other out."""
    return _named("mapless", settings)


def session_cookie_name(settings: Settings) -> str:
    """Of who signed in with an account."""
    return _named("mapless-session", settings)


def may_be_signed_in(request: HTTPConnection, settings: Settings) -> bool:
    """Whether who asks brings a login along, be it a true one or not."""
    logins = {cookie_name(settings), session_cookie_name(settings)}
    return "authorization" in request.headers or not logins.isdisjoint(request.cookies)


def session_cookie(request: HTTPConnection, settings: Settings, secret: str) -> str:
    """The header that keeps a session's secret in the browser, as `set_login_cookie` keeps the login."""
    response = Response()
    set_session(response, request, settings, secret)
    return response.headers["set-cookie"]


def set_session(response: Response, request: HTTPConnection, settings: Settings, secret: str) -> None:
    """Sign the browser in."""
    _set(response, request, settings, session_cookie_name(settings), secret)


def journey_cookie_name(settings: Settings) -> str:
    """Of who is at the provider of identities to sign in."""
    return _named("mapless-journey", settings)


def set_journey(response: Response, request: HTTPConnection, settings: Settings, sealed: str, seconds: int) -> None:
    """Keep what the browser comes back with; it comes from the provider's page, which *strict* would not allow."""
    response.set_cookie(
        journey_cookie_name(settings),
        sealed,
        max_age=seconds,
        path=settings.path_prefix + _JOURNEY_PATH,
        httponly=True,
        samesite="lax",
        secure=request.url.scheme == "https",
    )


def clear_journey(response: Response, settings: Settings) -> None:
    """Forget it: it serves once."""
    path = settings.path_prefix + _JOURNEY_PATH
    response.delete_cookie(journey_cookie_name(settings), path=path, httponly=True, samesite="lax")


def clear_cookies(response: Response, settings: Settings) -> None:
    """Log the browser out."""
    for name in (cookie_name(settings), session_cookie_name(settings)):
        response.delete_cookie(name, path=_path(settings), httponly=True, samesite="strict")


def set_login_cookie(response: Response, request: Request, settings: Settings, secrets: Secrets) -> None:
    """Log the browser in: out of reach of scripts, and not sent along by other sites' pages."""
    _set(response, request, settings, cookie_name(settings), secrets.cookie)


def _set(response: Response, request: HTTPConnection, settings: Settings, name: str, value: str) -> None:
    response.set_cookie(
        name,
        value,
        max_age=_THIRTY_DAYS,
        path=_path(settings),
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
    )


def _named(kind: str, settings: Settings) -> str:
    """Below a path it has the path in it: of two cookies of one name, for a path and for all, a browser sends both."""
    return f"{kind}-{settings.port}{settings.path_prefix.replace('/', '-')}"


def _path(settings: Settings) -> str:
    return settings.path_prefix or "/"
