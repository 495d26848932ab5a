"""Where a request comes from: the address of the connection, or what a trusted proxy says about it."""

import logging
from collections.abc import Sequence

from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

logger = logging.getLogger(__name__)


class ClientAddressMiddleware:
    """Believes `X-Forwarded-For` and `X-Forwarded-Proto` of the proxies in the settings, and of nobody else.

    Args:
        app: what is asked next.
        trusted_proxies: addresses or networks of proxies in front of the server.
    """

    def __init__(self, app: ASGIApp, trusted_proxies: Sequence[str]) -> None:
        self._app = app
        self._believing = ProxyHeadersMiddleware(app, list(trusted_proxies))  # type: ignore[arg-type]
        self._warned = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, with the client's address and scheme in their place."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        client = scope.get("client")
        if client is not None and client[0] in self._believing.trusted_hosts:
            await self._believing(scope, receive, send)  # type: ignore[arg-type]
            return
        if not self._warned and any(name == b"x-forwarded-for" for name, _ in scope["headers"]):
            self._warned = True
            logger.warning(
                "a request through a proxy at %s is taken for the proxy's own: if the proxy is yours, set "
                "MAPLESS_TRUSTED_PROXIES to its address",
                client[0] if client else "an unknown address",
            )
        await self._app(scope, receive, send)
