"""Clients that take for ever: headers, bodies and answers have a time in which they must get on, or the connection ends."""

import asyncio
from typing import NoReturn, cast

import anyio
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from server.errors import ErrorBody

# A body that comes slower than this is not meant to arrive: a checkpoint over the worst of lines is quicker.
_BYTES_PER_SECOND = 1024
# An answer that nobody reads is kept for so many times the time that a request may take: a tab may be asleep.
_UNREAD = 3
# Until the event loop has looked at its sockets once more.
_ONE_TURN_SECONDS = 0.001


def timed_protocol(seconds: float) -> type[asyncio.Protocol]:
    """A protocol for uvicorn that closes a connection whose headers are not complete within `seconds`.

    uvicorn itself waits for ever, except between two requests. There it would hang up on whoever asks while the loop is
    busy: the time is up before the loop has looked at its sockets again.
    """

    class TimedProtocol(HttpToolsProtocol):
        _timer: asyncio.TimerHandle | None = None
        _heard = False

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            self._arm()

        def data_received(self, data: bytes) -> None:
            self._heard = True
            if self.cycle is None or self.cycle.response_complete:
                self._arm()
            super().data_received(data)

        def on_message_begin(self) -> None:
            self._arm()
            super().on_message_begin()

        def on_headers_complete(self) -> None:
            self._disarm()
            super().on_headers_complete()

        def connection_lost(self, exc: Exception | None) -> None:
            self._disarm()
            super().connection_lost(exc)

        def timeout_keep_alive_handler(self) -> None:
            self.timeout_keep_alive_task = self.loop.call_later(_ONE_TURN_SECONDS, super().timeout_keep_alive_handler)

        def _arm(self) -> None:
            if self._timer is None:
                self._timer = self.loop.call_later(seconds, self._end)

        def _disarm(self) -> None:
            if self._timer is not None:
                self._timer.cancel()
                self._timer = None

        def _end(self) -> None:
            self._timer = None
            if self.cycle is not None and not self.cycle.response_complete:
                return  # the next request is not read on before this one is answered
            # A browser that connected ahead of time and sent nothing expects no answer.
            if self._heard and not self.transport.is_closing():
                self.transport.write(b"HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n")
            self.transport.close()

    return cast("type[asyncio.Protocol]", TimedProtocol)


class SlowClientMiddleware:
    """Ends requests whose body stands still, and answers that nobody reads.

    Args:
        app: what is asked next.
        seconds: in which the next part of a body must come; all of it may take as much longer as 1 KiB a second allows.
    """

    def __init__(self, app: ASGIApp, seconds: float) -> None:
        self._app = app
        self._seconds = seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, with a watch on both ways."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        exchange = _Exchange(self._seconds, receive, send)
        with exchange.ended:
            await self._app(scope, exchange.receive, exchange.send)
        if exchange.late and not exchange.started:
            detail = (
                f"The body of this request did not arrive within {self._seconds:g} s: check the connection, and try again."
            )
            answer = JSONResponse(ErrorBody(detail=detail).model_dump(), status_code=408, headers={"Connection": "close"})
            await answer(scope, receive, send)


class _Exchange:
    """One request and its answer; `late`, where its client was too slow."""

    def __init__(self, seconds: float, receive: Receive, send: Send) -> None:
        self._seconds = seconds
        self._receive = receive
        self._send = send
        self._budget = seconds
        self._complete = False
        self.ended = anyio.CancelScope()
        self.late = False
        self.started = False

    async def receive(self) -> Message:
        """The next part of the body; after the last one, the end of the connection."""
        if self._complete:
            return await self._receive()
        clock = asyncio.get_running_loop()
        began = clock.time()
        try:
            async with asyncio.timeout(min(self._seconds, self._budget)):
                message = await self._receive()
        except TimeoutError:
            await self._end()
        self._budget += len(message.get("body", b"")) / _BYTES_PER_SECOND - (clock.time() - began)
        self._complete = not message.get("more_body", False)
        return message

    async def send(self, message: Message) -> None:
        """Pass a part of the answer on; it is taken up once the client has read what came before."""
        try:
            async with asyncio.timeout(_UNREAD * self._seconds):
                await self._send(message)
        except TimeoutError:
            await self._end()
        self.started = True

    async def _end(self) -> NoReturn:
        self.late = True
        self.ended.cancel()
        await anyio.sleep_forever()
        raise AssertionError("cancelled just now")
