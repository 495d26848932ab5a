"""Says in every answer from when it is, so that a page that listens afterwards misses nothing in between."""

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.events.bus import EventBus

HEADER = "Mapless-Position"
"""The position (`since` of the change stream) before which everything is in the answer."""


class PositionMiddleware:
    """Adds `HEADER` to what the API answers.

    Args:
        app: what is asked next.
        bus: whose position it is.
    """

    def __init__(self, app: ASGIApp, bus: EventBus) -> None:
        self._app = app
        self._bus = bus

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on; what is published from now on may be missing from the answer."""
        if scope["type"] != "http" or not scope["path"].startswith("/api/"):
            await self._app(scope, receive, send)
            return
        position = self._bus.position

        async def send_with_position(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)[HEADER] = position
            await send(message)

        await self._app(scope, receive, send_with_position)
