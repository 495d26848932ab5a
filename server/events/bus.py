"""What has changed, told to whoever listens in this process: browsers over SSE, and the links to the workers."""

import asyncio
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from typing import Literal

from server.schemas import Schema

ChangeKind = Literal["experiment", "run", "metrics", "checkpoint", "deleted"]


class Change(Schema):
    """Something is not as it was; the REST API says how it is now. `run_id` is null where all of an experiment is meant."""

    experiment_id: str
    run_id: str | None
    kind: ChangeKind


class Subscription:
    """One listener's pending changes. Equal ones that wait are one: that something changed counts, not how often."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._lock = threading.Lock()
        self._pending: dict[Change, None] = {}
        self._closed = False
        self._woken = asyncio.Event()

    def put(self, change: Change) -> None:
        """Add a change, from any thread."""
        with self._lock:
            wake = not self._pending
            self._pending[change] = None
        if wake:
            self._wake()

    def close(self) -> None:
        """End the iteration once what is pending has been read, from any thread."""
        self._closed = True
        self._wake()

    async def batches(self, pause: float) -> AsyncIterator[list[Change]]:
        """Lists of changes as they come, at most one list every `pause` seconds."""
        while True:
            await self._woken.wait()
            self._woken.clear()
            with self._lock:
                batch = list(self._pending)
                self._pending.clear()
            if batch:
                yield batch
            if self._closed:
                return
            await asyncio.sleep(pause)

    def _wake(self) -> None:
        # The loop may have ended before its listeners did, at shutdown; nobody is left to be woken then.
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._woken.set)


class EventBus:
    """Fans changes out to subscriptions; `publish` may be called from any thread, after the commit that it tells of."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._subscriptions: set[Subscription] = set()
        self._closed = False

    def publish(self, change: Change) -> None:
        """Tell everybody who listens now."""
        with self._lock:
            subscriptions = tuple(self._subscriptions)
        for subscription in subscriptions:
            subscription.put(change)

    @contextmanager
    def subscribe(self) -> Iterator[Subscription]:
        """Listen from now to the end of the block; call it on the event loop that will read."""
        subscription = Subscription(asyncio.get_running_loop())
        with self._lock:
            self._subscriptions.add(subscription)
            closed = self._closed
        if closed:
            subscription.close()
        try:
            yield subscription
        finally:
            with self._lock:
                self._subscriptions.discard(subscription)

    def close(self) -> None:
        """End every subscription, those to come included; called when the server begins to shut down."""
        with self._lock:
            self._closed = True
            subscriptions = tuple(self._subscriptions)
        for subscription in subscriptions:
            subscription.close()
