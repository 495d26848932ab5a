"""Ends what nobody waits for any more: a question whose asker has left before the answer began.

A page asks again when something has changed, a tab is closed, a proxy gives up. What still waits for a thread then is never
begun, and what has begun ends at its next look (`stop_if_abandoned`): else answers that nobody reads keep the threads that
others wait for, and the server from shutting down.
"""

import asyncio
import contextlib
from collections.abc import MutableMapping
from typing import Any

import anyio
from anyio import from_thread
from starlette.types import ASGIApp, Message, Receive, Scope, Send

# What takes time: the pages' files are there at once.
_PREFIXES = ("/api/", "/replays/")


def stop_if_abandoned() -> None:
    """Raise if the request that this thread works for was abandoned; to be called between pieces of long work.

    Raises:
        asyncio.CancelledError: nobody waits for the answer.
    """
    # Outside a request's thread, in a command or a test, there is nobody who could leave.
    with contextlib.suppress(RuntimeError):
        from_thread.check_cancelled()


class AbandonedRequestsMiddleware:
    """Cancels reading requests of the API whose client has left; whatever changes something runs to its end."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        if scope["type"] != "http" or scope["method"] not in ("GET", "HEAD") or not scope["path"].startswith(_PREFIXES):
            await self._app(scope, receive, send)
            return
        left = anyio.Event()
        scope_of_answer = anyio.CancelScope()
        answering = heard = False

        async def watch() -> None:
            while (await receive())["type"] != "http.disconnect":
                pass
            left.set()
            # An answer that has begun ends by its own means: a stream has things to close.
            if not answering:
                scope_of_answer.cancel()

        async def hear() -> Message:
            nonlocal heard
            if not heard:
                heard = True
                return {"type": "http.request", "body": b"", "more_body": False}
            await left.wait()
            return {"type": "http.disconnect"}

        async def answer(message: MutableMapping[str, Any]) -> None:
            nonlocal answering
            answering = True
            await send(message)

        watching = asyncio.create_task(watch())
        try:
            with scope_of_answer:
                await self._app(scope, hear, answer)
        finally:
            watching.cancel()
