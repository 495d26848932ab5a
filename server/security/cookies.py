"""The login cookie."""

from starlette.requests import Request
from starlette.responses import Response

from server.security.secrets import Secrets
from server.settings import Settings

_THIRTY_DAYS = 30 * 24 * 3600


def cookie_name(settings: Settings) -> str:
    """Cookies are shared by all ports of a host; with the port in its name, two installations don't log each other out."""
    return f"mapless-{settings.port}"


def set_login_cookie(response: Response, request: Request, settings: Settings, secrets: Secrets) -> None:
    """Log the browser in: out of reach of scripts, and not sent along by other sites' pages."""
    response.set_cookie(
        cookie_name(settings),
        secrets.cookie,
        max_age=_THIRTY_DAYS,
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
    )
