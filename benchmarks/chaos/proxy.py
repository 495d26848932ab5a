"""A TCP proxy between two parts of the service, which cuts, refuses and silences connections and loses single answers."""

import asyncio
import contextlib
import threading
from collections.abc import Callable
from typing import Literal

_BLOCK = 64 * 1024

Way = Literal["open", "refused", "silent"]


class Trap:
    """Waits for the next request that contains `pattern`, on any of the proxies that it is set at, and breaks it.

    Args:
        pattern: bytes that such a request begins with, or holds in its first block.
        lose: 'request' lets half of the block through and then closes the connection; 'answer' lets the whole request
            through and closes when the answer comes, so that it was carried out and nobody heard of it.
    """

    def __init__(self, pattern: bytes, lose: Literal["request", "answer"]) -> None:
        self.pattern = pattern
        self.lose = lose
        self.sprung = threading.Event()
        self._lock = threading.Lock()

    def catches(self, data: bytes) -> bool:
        """Whether this block is the one; true once only."""
        if self.pattern not in data:
            return False
        with self._lock:
            first = not self.sprung.is_set()
            self.sprung.set()
            return first


class Proxy:
    """Listens on a free port of 127.0.0.1 and carries what comes there to another port, on a thread of its own.

    Args:
        target: port of 127.0.0.1 that the connections go to.
    """

    def __init__(self, target: int) -> None:
        self._target = target
        self._way: Way = "open"
        self._trap: Trap | None = None
        self._connections: set[tuple[asyncio.StreamWriter, asyncio.StreamWriter]] = set()
        self._loop = asyncio.new_event_loop()
        self._flowing = asyncio.Event()
        self._flowing.set()
        self._server = self._loop.run_until_complete(asyncio.start_server(self._carry, "127.0.0.1", 0))
        self.port: int = self._server.sockets[0].getsockname()[1]
        self._thread = threading.Thread(target=self._loop.run_forever, name=f"proxy {self.port}", daemon=True)
        self._thread.start()

    def cut(self) -> None:
        """Close every connection, as a network that breaks does; new ones are carried."""
        self._on_loop(self._abort)

    def refuse(self) -> None:
        """Close every connection, and every new one, until `open`."""
        self._on_loop(lambda: self._go("refused"))

    def silence(self) -> None:
        """Carry nothing any more and close nothing, until `open`: what was sent meanwhile arrives late."""
        self._on_loop(lambda: self._go("silent"))

    def open(self) -> None:
        """Carry everything again."""
        self._on_loop(lambda: self._go("open"))

    def set_trap(self, trap: Trap | None) -> None:
        """Break the request that this trap waits for; None takes it away."""
        self._trap = trap

    def close(self) -> None:
        """Close everything and end the thread."""

        async def end() -> None:
            self._server.close()
            self._abort()
            rest = asyncio.all_tasks(self._loop) - {asyncio.current_task(self._loop)}
            for task in rest:
                task.cancel()
            await asyncio.gather(*rest, return_exceptions=True)

        asyncio.run_coroutine_threadsafe(end(), self._loop).result(5)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _on_loop(self, action: Callable[[], None]) -> None:
        async def act() -> None:
            action()

        asyncio.run_coroutine_threadsafe(act(), self._loop).result(5)

    def _go(self, way: Way) -> None:
        self._way = way
        if way == "refused":
            self._abort()
        if way == "silent":
            self._flowing.clear()
        else:
            self._flowing.set()

    def _abort(self) -> None:
        for ends in tuple(self._connections):
            for end in ends:
                end.transport.abort()

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._way == "refused":
            writer.transport.abort()
            return
        try:
            there, back = await asyncio.open_connection("127.0.0.1", self._target)
        except OSError:
            writer.transport.abort()
            return
        ends = (writer, back)
        self._connections.add(ends)
        doomed = asyncio.Event()
        ways = [asyncio.create_task(self._up(reader, back, doomed)), asyncio.create_task(self._down(there, writer, doomed))]
        try:
            # Cancelled as the proxy closes: asyncio would log it.
            with contextlib.suppress(asyncio.CancelledError):
                await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            self._connections.discard(ends)
            for end in ends:
                end.close()

    async def _up(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, doomed: asyncio.Event) -> None:
        with contextlib.suppress(OSError):
            while data := await reader.read(_BLOCK):
                await self._flowing.wait()
                trap = self._trap
                if trap is not None and trap.catches(data):
                    if trap.lose == "request":
                        writer.write(data[: len(data) // 2])
                        await writer.drain()
                        return
                    doomed.set()
                writer.write(data)
                await writer.drain()

    async def _down(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, doomed: asyncio.Event) -> None:
        with contextlib.suppress(OSError):
            while data := await reader.read(_BLOCK):
                await self._flowing.wait()
                if doomed.is_set():
                    return
                writer.write(data)
                await writer.drain()
