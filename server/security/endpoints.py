"""The route that logs a browser in."""

import hmac

from fastapi import APIRouter, Request, Response, status

from server.errors import UnauthorizedError
from server.security.cookies import set_login_cookie
from server.security.permissions import OPEN
from server.security.schemas import Login
from server.services import ServicesDep

router = APIRouter(tags=["login"])


@router.post("/api/login", status_code=status.HTTP_204_NO_CONTENT, dependencies=[OPEN])
async def login(credentials: Login, request: Request, response: Response, services: ServicesDep) -> None:
    """Exchange the token that the server printed at start for a cookie."""
    await services.login_limiter.turn(request)
    if not hmac.compare_digest(credentials.token.encode(), services.secrets.token.encode()):
        services.login_limiter.failed(request, credentials.token)
        raise UnauthorizedError("Wrong token: copy it from the URL that the server printed at start.")
    set_login_cookie(response, request, services.settings, services.secrets)
