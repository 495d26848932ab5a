"""That every route says what it takes."""

from fastapi import APIRouter
from fastapi.routing import APIRoute, APIWebSocketRoute

from server.security.permissions import Permission, permission_of


def declared(router: APIRouter) -> list[tuple[APIRoute | APIWebSocketRoute, Permission | None]]:
    """Every route with the permission that it names; None where it names none, or several."""
    routes = [route for route in router.routes if isinstance(route, (APIRoute, APIWebSocketRoute))]
    assert len(routes) == len(router.routes), "only FastAPI's own routes can name a permission"
    return [(route, permission_of(route.dependencies)) for route in routes]


def check_permissions(router: APIRouter) -> None:
    """Refuse a route that everybody could use because somebody forgot to say who may.

    Raises:
        ValueError: with the route.
    """
    for route, permission in declared(router):
        if permission is None:
            raise ValueError(f"{route.path} names no permission: see server/security/permissions.py")
