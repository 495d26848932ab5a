"""Which run a request is about, for what is logged while it is answered."""

import re

from starlette.types import ASGIApp, Receive, Scope, Send

from workers.logs import about

# Ids are short; what somebody else writes there does not fill the log.
_RUN = re.compile(r"/(?:api/|api/worker/)?(?:runs|live)/([0-9a-zA-Z-]{1,64})(?:/|$)")


class RunLogsMiddleware:
    """Names the run of a request's path in every line that is logged for it.

    Args:
        app: what is asked next.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, with the run in the log's context."""
        found = _RUN.match(scope["path"]) if scope["type"] in ("http", "websocket") else None
        if found is None:
            await self._app(scope, receive, send)
            return
        with about(found[1]):
            await self._app(scope, receive, send)
