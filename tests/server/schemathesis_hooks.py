"""What Schemathesis is told of this API: a body that it can't make by itself, and what every 503 must bring."""

from http import HTTPStatus
from typing import Any

import schemathesis


@schemathesis.serializer("application/x-tar")
def tar(_context: schemathesis.SerializationContext, value: Any) -> bytes:
    """Whatever bytes: an archive that is none."""
    return value if isinstance(value, bytes) else str(value).encode(errors="replace")


@schemathesis.check
def comes_again(_context: schemathesis.CheckContext, response: schemathesis.Response, _case: schemathesis.Case[Any]) -> None:
    """Who is refused for now is told when to come again."""
    if response.status_code in (HTTPStatus.TOO_MANY_REQUESTS, HTTPStatus.SERVICE_UNAVAILABLE):
        assert int(response.headers.get("retry-after", ["0"])[0]) >= 1, "no Retry-After"
