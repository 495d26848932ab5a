"""How long requests take, by route."""

import time
from typing import Any

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.monitoring.instruments import Instruments

_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})


class RequestTimesMiddleware:
    """Notes how long each answer took to begin: streams and downloads go on for as long as their clients like.

    Args:
        app: what is asked next.
        instruments: to note it in.
    """

    def __init__(self, app: ASGIApp, instruments: Instruments) -> None:
        self._app = app
        self._instruments = instruments

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, with a clock."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began = time.perf_counter()

        async def note(message: Message) -> None:
            if message["type"] == "http.response.start":
                method = scope["method"] if scope["method"] in _METHODS else "other"
                status = f"{message['status'] // 100}xx"
                labels = self._instruments.requests.labels(method, _route(scope), status)
                labels.observe(time.perf_counter() - began)
            await send(message)

        await self._app(scope, receive, note)


def _route(scope: Any) -> str:
    """The route's pattern: an id in a label would make a series of each run. Everything that is no route is one."""
    path = getattr(scope.get("route"), "path", None)
    return path if isinstance(path, str) and not path.startswith("/{") else "other"
