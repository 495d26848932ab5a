"""HTTP as cheaply as it can be asked for: two hundred browsers share a core with everything else that makes the load.

A client's library takes milliseconds a request and looks through all its connections for each; here an answer's end is found
by its length, and its body is counted, not kept.
"""

import asyncio
import re
from collections.abc import Callable
from urllib.parse import urlsplit

_LENGTH = re.compile(rb"\r\ncontent-length: *(\d+)", re.IGNORECASE)
_END_OF_HEAD = b"\r\n\r\n"
_STATUS = slice(9, 12)


class LostError(Exception):
    """The server has ended a connection before it had answered."""


class _Connection(asyncio.Protocol):
    """One connection, one request at a time."""

    def __init__(self) -> None:
        self._transport: asyncio.Transport | None = None
        self._answer: asyncio.Future[int] | None = None
        self._head = b""
        self._status = 0
        self._missing = 0
        self.lost = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def ask(self, request: bytes) -> "asyncio.Future[int]":
        """Send a request; the status of the answer once all of it is there."""
        assert self._transport is not None
        self._head, self._status = b"", 0
        self._answer = asyncio.get_running_loop().create_future()
        self._transport.write(request)
        return self._answer

    @property
    def answering(self) -> bool:
        """Whether any of the answer has come."""
        return bool(self._head) or self._status != 0

    def data_received(self, data: bytes) -> None:
        if self._status == 0:
            self._head += data
            end = self._head.find(_END_OF_HEAD)
            if end < 0:
                return
            length = _LENGTH.search(self._head, 0, end)
            self._status = int(self._head[_STATUS])
            self._missing = (int(length[1]) if length else 0) + end + len(_END_OF_HEAD) - len(self._head)
        else:
            self._missing -= len(data)
        if self._missing <= 0 and self._answer is not None and not self._answer.done():
            self._answer.set_result(self._status)

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost = True
        if self._answer is not None and not self._answer.done():
            self._answer.set_exception(LostError())

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()


class _Stream(asyncio.Protocol):
    """A connection on which one answer goes on and on."""

    def __init__(self, request: bytes, count: Callable[[int], None]) -> None:
        self._request = request
        self._count = count
        self.ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        transport.write(self._request)

    def data_received(self, data: bytes) -> None:
        self._count(len(data))

    def connection_lost(self, exc: Exception | None) -> None:
        if not self.ended.done():
            self.ended.set_result(None)


class Browser:
    """Asks as a browser does: connections are kept, and what a kept one has not answered is asked for once more.

    Args:
        url: of the server.
        token: of a login.
        seconds: after which an answer that has not come is given up.

    Attributes:
        asked_again: how often a kept connection was found closed only when it was used.
    """

    def __init__(self, url: str, token: str, seconds: float = 30.0) -> None:
        parts = urlsplit(url)
        self._host, self._port = parts.hostname or "127.0.0.1", parts.port or 80
        headers = (f"Host: {parts.netloc}", f"Authorization: Bearer {token}", "Accept-Encoding: gzip, deflate, br, zstd")
        self._headers = "\r\n".join((" HTTP/1.1", *headers, "", ""))
        self._seconds = seconds
        self._idle: list[_Connection] = []
        self.asked_again = 0

    async def get(self, path: str) -> int:
        """The status of the answer, once all of it is there.

        Raises:
            LostError: the connection ended first.
            OSError, TimeoutError: there is none, or no answer in time.
        """
        async with asyncio.timeout(self._seconds):
            request = self._request(path)
            while self._idle:
                connection = self._idle.pop()
                if connection.lost:
                    continue
                try:
                    return await self._ask(connection, request)
                except LostError:
                    if connection.answering:
                        raise
                    self.asked_again += 1
                    break
            _, connection = await asyncio.get_running_loop().create_connection(_Connection, self._host, self._port)
            return await self._ask(connection, request)

    async def follow(self, path: str, count: Callable[[int], None], seconds: float) -> bool:
        """Read an answer that goes on, for so long; whether it had not ended by then.

        Args:
            path: what is asked for.
            count: told how many bytes have come, whenever some have.
            seconds: until it is closed here.

        Raises:
            OSError: there is no connection.
        """
        loop = asyncio.get_running_loop()
        transport, stream = await loop.create_connection(lambda: _Stream(self._request(path), count), self._host, self._port)
        try:
            await asyncio.wait_for(stream.ended, seconds)
        except TimeoutError:
            return True
        finally:
            transport.close()
        return False

    def close(self) -> None:
        """Close every connection that is kept."""
        for connection in self._idle:
            connection.close()

    def _request(self, path: str) -> bytes:
        return f"GET {path}{self._headers}".encode()

    async def _ask(self, connection: _Connection, request: bytes) -> int:
        try:
            status = await connection.ask(request)
        except asyncio.CancelledError:
            connection.close()
            raise
        self._idle.append(connection)
        return status
