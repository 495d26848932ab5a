"""The links that are open now, one a run: how the rest of the service speaks to the worker that trains it."""

import asyncio
from collections.abc import Callable

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from server.worker_api.ingest import Ingest
from workers.protocol import CLOSE_FENCED, Orders
from workers.reporting import WatchRequest


class OpenLink:
    """A worker's WebSocket. Everything that it should know goes out whole, in one message, by one writer.

    Its methods belong to the server's event loop.
    """

    def __init__(self, websocket: WebSocket) -> None:
        self._websocket = websocket
        self._orders = Orders(ack=0)
        self._changed = asyncio.Event()
        self._fenced = False

    def tell(self, orders: Orders) -> None:
        """Pass on what a transaction has brought about; a stop and a refusal are never taken back."""
        self._set(
            ack=orders.ack,
            refused=self._orders.refused or orders.refused,
            stop=self._orders.stop or orders.stop,
            over=orders.over,
        )
        # Also where nothing has changed: the worker waits for this answer.
        self._changed.set()

    def stop(self) -> None:
        """Ask the worker to end."""
        self._set(stop=True)

    def watch(self, request: WatchRequest | None) -> None:
        """Tell the worker what somebody wants to see."""
        self._set(watch=request)

    def fence(self) -> None:
        """Cut the worker off."""
        self._fenced = True
        self._changed.set()

    async def write(self) -> None:
        """Send what changes until the worker is cut off."""
        while True:
            await self._changed.wait()
            self._changed.clear()
            if self._fenced:
                if self._websocket.application_state == WebSocketState.CONNECTED:
                    await self._websocket.close(CLOSE_FENCED, "this attempt is over")
                return
            try:
                await self._websocket.send_text(self._orders.model_dump_json())
            except WebSocketDisconnect:
                return

    def _set(self, **changes: object) -> None:
        changed = self._orders.model_copy(update=changes)
        if changed != self._orders:
            self._orders = changed
            self._changed.set()


class OpenLinks:
    """The `Links` of a server with workers, by run.

    Attributes:
        ingest: where what they report goes.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, ingest: Ingest) -> None:
        self.ingest = ingest
        self._loop = loop
        self._by_run: dict[str, OpenLink] = {}

    def add(self, run_id: str, link: OpenLink) -> None:
        """A worker is linked for this run; the newest link is the one that is spoken to. On the event loop."""
        self._by_run[run_id] = link

    def remove(self, run_id: str, link: OpenLink) -> None:
        """The link has ended. On the event loop."""
        if self._by_run.get(run_id) is link:
            del self._by_run[run_id]

    def stop(self, run_id: str) -> None:
        """Ask the run's worker to write a checkpoint and end; from any thread."""
        self._on_link(run_id, OpenLink.stop)

    def cut(self, run_id: str) -> None:
        """Fence the run's worker out at once; from any thread."""
        self._on_link(run_id, OpenLink.fence)

    def _on_link(self, run_id: str, action: Callable[[OpenLink], None]) -> None:
        def act() -> None:
            if (link := self._by_run.get(run_id)) is not None:
                action(link)

        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(act)
