"""A scene's own port is for the bridge alone: a secret that never leaves this process opens it.

The port is on 127.0.0.1, where every user of the machine, and every page in a browser of theirs, could knock.
"""

import hmac
import http
import secrets
from typing import Any

from websockets.asyncio.server import ServerConnection, serve
from websockets.http11 import Request, Response

_SCHEME = "Bearer"
_SECRET = secrets.token_urlsafe(32)

KEY = {"Authorization": f"{_SCHEME} {_SECRET}"}
"""The headers of a handshake that opens a scene's port."""


class GatedServe(serve):
    """websockets' `serve` for viser: whoever does not bring `KEY` is answered 403 before the handshake."""

    def __init__(self, handler: Any, host: str, port: int, **options: Any) -> None:
        # viser's own would hand out its client, which comes from our pages.
        super().__init__(handler, host, port, **options | {"process_request": _only_with_the_key})


def _only_with_the_key(connection: ServerConnection, request: Request) -> Response | None:
    given = request.headers.get_all("Authorization")
    if len(given) == 1 and hmac.compare_digest(given[0].encode(errors="surrogateescape"), KEY["Authorization"].encode()):
        return None
    return connection.respond(http.HTTPStatus.FORBIDDEN, "This port is the server's own.\n")
