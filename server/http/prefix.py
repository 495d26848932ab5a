"""Below a path: what a proxy passes on from https://lab.example/mapless/ is answered as if it stood at the root.

Inside, addresses have no prefix: neither routes nor what decides who may come in know of it. It is taken off here before
anything looks at a request, and put before every place that an answer leads to. A proxy may have taken it off already, and
programs on this machine need not know it.
"""

from urllib.parse import urlsplit

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Scope, Send

# Starlette's word for where an application begins: what `request.base_url` ends with.
_BEGINS = "app_root_path"


class PathPrefixMiddleware:
    """Takes the prefix off addresses, and puts it before redirects.

    Args:
        app: what is asked next.
        public_url: how browsers reach the pages; its path is the prefix.
    """

    def __init__(self, app: ASGIApp, public_url: str) -> None:
        self._app = app
        parts = urlsplit(public_url)
        self._prefix = parts.path.rstrip("/")
        self._host = parts.netloc.lower()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, without the prefix."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        path, within = self._within(scope["path"])
        if within or HTTPConnection(scope).headers.get("host", "").lower() == self._host:
            scope[_BEGINS] = self._prefix
        raw = scope.get("raw_path")
        if within and raw is not None:
            scope["raw_path"] = raw.removeprefix(self._prefix.encode()) or b"/"
        scope["path"] = path

        async def send_leading(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                if headers.get("location", "").startswith("/"):
                    headers["location"] = self._prefix + headers["location"]
            await send(message)

        await self._app(scope, receive, send_leading)

    def _within(self, path: str) -> tuple[str, bool]:
        if path == self._prefix:
            return "/", True
        if path.startswith(f"{self._prefix}/"):
            return path.removeprefix(self._prefix), True
        return path, False


def is_at_home(connection: HTTPConnection, prefix: str) -> bool:
    """Whether the browser's address has the prefix, as the pages need it."""
    begins: str = connection.scope.get(_BEGINS, "")
    return begins == prefix
