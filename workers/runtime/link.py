"""The link of a run: a thread that brings what is spooled, and frames, to the server, and hears what the server wants.

It renews the lease whatever the trainer does, reconnects for as long as it takes, and ends when the server has the final
message or fences the attempt out. Where an item can never arrive, because the spool is damaged or the server does not take
it, it says so (`on_broken`), keeps the lease, and sends no item any more: the attempt is lost, however its trainer ended.
"""

import asyncio
import logging
import threading
from collections import deque
from collections.abc import Callable

from pydantic import ValidationError
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from workers.errors import SpoolDamagedError
from workers.protocol import (
    CLOSE_FENCED,
    CLOSE_NOT_UNDERSTOOD,
    MAX_MESSAGE_BYTES,
    Batch,
    EventItem,
    Final,
    MetricItem,
    Orders,
)
from workers.runtime.spool import Spool

logger = logging.getLogger(__name__)

# Frames that wait for the network, at most; older ones are worth nothing.
_FRAME_BACKLOG = 20
_FIRST_RETRY_SECONDS = 0.2
_LAST_RETRY_SECONDS = 3.0
_OPEN_TIMEOUT_SECONDS = 5.0
# A server that has not acknowledged for this long gets a new connection.
_ACK_TIMEOUT_SECONDS = 20.0
# What the server does not understand as often as this it never will; a frame on its own is not sent again.
_MISUNDERSTOOD = 3
# The server takes 10,000 in an explanation.
_EXPLANATION_CHARACTERS = 9_000
# Messages in a third of the lease each: two may be lost before the lease is.
_RENEWALS_PER_LEASE = 3


class Link:
    """A run's WebSocket to the server, kept open by a thread of its own.

    Args:
        server_url: base URL of the server, http or https.
        token: the workers' token.
        run_id: the run.
        attempt: fencing token of the claim.
        spool: where the items come from; acknowledged as the server confirms them.
        lease_seconds: how long the server waits for a sign of life.
        on_orders: called on the link's thread with each of the server's messages; must return at once.
        on_broken: called on the link's thread, once, with the reason why the next item can never arrive; must return too.
    """

    def __init__(
        self,
        server_url: str,
        token: str,
        run_id: str,
        attempt: int,
        spool: Spool,
        lease_seconds: float,
        on_orders: Callable[[Orders], None],
        on_broken: Callable[[str], None],
    ) -> None:
        self._url = f"ws{server_url.removeprefix('http')}/api/worker/runs/{run_id}/link?attempt={attempt}"
        self._headers = {"Authorization": f"Bearer {token}"}
        self._spool = spool
        self._renewal_seconds = lease_seconds / _RENEWALS_PER_LEASE
        self._on_orders = on_orders
        self._on_broken = on_broken
        self._broken: str | None = None
        self._misunderstood = 0
        self._waiting = False
        self._retry = _FIRST_RETRY_SECONDS
        self._frames: deque[bytes] = deque(maxlen=_FRAME_BACKLOG)
        self._final: Final | None = None
        self._fenced = False
        self._closed = False
        self._done = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._wake = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name=f"link {run_id}", daemon=True)
        self._thread.start()

    def fenced(self) -> bool:
        """The server has cut this attempt off: nothing that it says counts any more."""
        return self._fenced

    @property
    def done(self) -> bool:
        """Nothing more will be sent: fenced, finished or closed."""
        return self._done.is_set()

    def notify(self) -> None:
        """Something new is in the spool."""
        self._call(self._wake.set)

    def frame(self, data: bytes) -> None:
        """Send an encoded frame if the network is quick enough for it."""
        self._frames.append(data)
        self.notify()

    def finish(self, final: Final) -> None:
        """Send the final message, after everything that is spooled; `done` tells when the server has it."""
        self._final = final
        self.notify()

    def wait(self, seconds: float) -> bool:
        """Whether the link was done within that time."""
        return self._done.wait(seconds)

    def close(self) -> None:
        """Give up whatever is not sent, and end the thread."""
        self._closed = True
        self.notify()
        self._thread.join()

    def _call(self, callback: Callable[[], None]) -> None:
        try:
            self._loop.call_soon_threadsafe(callback)
        except RuntimeError:
            return  # the loop has ended, and with it the link

    def _run(self) -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
                runner.run(self._keep_open())
        finally:
            self._done.set()

    async def _keep_open(self) -> None:
        while not self._over():
            try:
                async with connect(
                    self._url,
                    additional_headers=self._headers,
                    open_timeout=_OPEN_TIMEOUT_SECONDS,
                    ping_interval=self._renewal_seconds,
                    ping_timeout=_ACK_TIMEOUT_SECONDS,
                    max_size=MAX_MESSAGE_BYTES,
                    compression=None,
                    proxy=None,
                ) as connection:
                    await self._serve(connection)
            except ConnectionClosed as closed:
                self._fenced = self._fenced or (closed.rcvd is not None and closed.rcvd.code == CLOSE_FENCED)
                if closed.rcvd is not None and closed.rcvd.code == CLOSE_NOT_UNDERSTOOD:
                    self._misunderstood += 1
                    if self._misunderstood == _MISUNDERSTOOD:
                        self._break(f"the server does not understand what comes after item {self._spool.acked}: {closed}")
                self._wait_for_server(closed)
            except (OSError, TimeoutError, InvalidHandshake) as error:
                self._wait_for_server(error)
            except ValidationError:
                logger.exception("the server says what this worker does not understand: do their versions agree?")
            if not self._over():
                await self._pause(self._retry)
                self._retry = min(2 * self._retry, _LAST_RETRY_SECONDS)

    def _wait_for_server(self, reason: Exception) -> None:
        if not self._over() and not self._waiting:
            logger.warning("%s: no link to the server, what is reported waits here: %s", self._thread.name, reason)
            self._waiting = True

    def _linked(self) -> None:
        """The server has answered: whoever only opens a connection may still be unable to serve."""
        self._retry = _FIRST_RETRY_SECONDS
        if self._waiting:
            logger.info("%s: linked to the server again", self._thread.name)
            self._waiting = False

    def _over(self) -> bool:
        return self._closed or self._fenced or self._done.is_set()

    async def _pause(self, seconds: float) -> None:
        """Sleep, but not through `close`."""
        waited = 0.0
        while waited < seconds and not self._closed:
            await asyncio.sleep(0.1)
            waited += 0.1

    async def _serve(self, connection: ClientConnection) -> None:
        """Ship until the connection or the attempt ends."""
        acked = asyncio.Event()
        reader = asyncio.create_task(self._read(connection, acked))
        try:
            writer = asyncio.create_task(self._write(connection, acked))
            try:
                finished, _ = await asyncio.wait((reader, writer), return_when=asyncio.FIRST_COMPLETED)
                for task in finished:
                    task.result()
            finally:
                writer.cancel()
        finally:
            reader.cancel()
            await asyncio.gather(reader, writer, return_exceptions=True)

    async def _read(self, connection: ClientConnection, acked: asyncio.Event) -> None:
        async for message in connection:
            orders = Orders.model_validate_json(message)
            self._linked()
            if orders.ack > self._spool.acked:
                self._misunderstood = 0
            self._spool.acknowledge(orders.ack)
            if orders.refused is not None:
                self._break(f"the server can't store item {orders.refused.seq}: {orders.refused.reason}")
            self._on_orders(orders)
            acked.set()
            if orders.over:
                self._done.set()
                return
        if connection.close_code == CLOSE_FENCED:
            self._fenced = True

    async def _write(self, connection: ClientConnection, acked: asyncio.Event) -> None:
        """One batch under way at a time; a frame may overtake it, and never keeps it or the lease's renewal waiting."""
        await asyncio.wait_for(acked.wait(), _ACK_TIMEOUT_SECONDS)
        loop = asyncio.get_running_loop()
        sent = loop.time()
        in_flight = False
        while not self._closed:
            self._wake.clear()
            if self._frames:
                await connection.send(self._frames.popleft())
            now = loop.time()
            if in_flight and acked.is_set():
                in_flight = False
            if not in_flight:
                # The final message is read first: it is set after the last item, so no item can be behind it.
                final = self._final
                items = self._pending()
                if items or final or now - sent >= self._renewal_seconds:
                    acked.clear()
                    await connection.send(Batch(items=items, final=None if items else self._honest(final)).model_dump_json())
                    sent, in_flight = now, True
            elif now - sent > _ACK_TIMEOUT_SECONDS:
                raise TimeoutError("the server does not acknowledge")
            if self._frames:
                await asyncio.sleep(0)  # the reader's turn, before the next frame
            else:
                await self._wait(acked if in_flight else None)

    def _pending(self) -> tuple[MetricItem | EventItem, ...]:
        """What is to be sent next; nothing any more once that can never arrive."""
        if self._broken is not None:
            return ()
        try:
            return self._spool.pending()
        except SpoolDamagedError as error:
            self._break(str(error))
            return ()

    def _break(self, reason: str) -> None:
        if self._broken is not None:
            return
        self._broken = reason[:_EXPLANATION_CHARACTERS]
        self._on_broken(self._broken)

    def _honest(self, final: Final | None) -> Final | None:
        """A final message that counted on everything to arrive is not sent where something never will."""
        if final is None or self._broken is None or final.outcome in ("lost", "failed"):
            return final
        return Final(outcome="lost", error=self._broken)

    async def _wait(self, acked: asyncio.Event | None) -> None:
        """Until there is something to send, the acknowledgement has come, or the lease wants renewing."""
        events = [self._wake] if acked is None else [self._wake, acked]
        tasks = [asyncio.create_task(event.wait()) for event in events]
        try:
            await asyncio.wait(tasks, timeout=self._renewal_seconds, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
