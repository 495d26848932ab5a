"""What routes ask for beside their own work."""

import inspect
from collections.abc import Iterator

from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute, APIWebSocketRoute

from server.app import ROUTERS


def _below(dependant: Dependant) -> Iterator[Dependant]:
    for each in dependant.dependencies:
        yield each
        yield from _below(each)


def test_what_hands_over_a_part_of_the_service_takes_no_thread() -> None:
    """The framework runs each plain function among a route's dependencies on a thread of its own."""
    plain = {
        f"{route.path}: {each.call}"
        for router in ROUTERS
        for route in router.routes
        if isinstance(route, APIRoute | APIWebSocketRoute)
        for each in _below(route.dependant)
        if not inspect.iscoroutinefunction(each.call) and not inspect.iscoroutinefunction(type(each.call).__call__)
    }

    assert plain == set()
