"""Work that the server does by itself, a little at a time, for as long as it runs."""

import asyncio
import contextlib
import logging
import threading
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager

from starlette.concurrency import run_in_threadpool

from server.errors import PartAwayError
from server.outage import RETRY_AFTER

logger = logging.getLogger(__name__)


class Wake:
    """Ends the pause of work that is done in the background. Thread-safe; what is rung while it works counts afterwards."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._rung = False
        self._waiting: tuple[asyncio.AbstractEventLoop, asyncio.Event] | None = None

    def ring(self) -> None:
        """There is something to do."""
        with self._lock:
            self._rung = True
            if self._waiting is not None:
                loop, event = self._waiting
                loop.call_soon_threadsafe(event.set)

    async def pause(self, seconds: float) -> None:
        """Until somebody rings, or has rung since the last pause; `seconds` at most."""
        event = asyncio.Event()
        with self._lock:
            if not self._rung:
                self._waiting = asyncio.get_running_loop(), event
        try:
            if self._waiting is not None:
                async with asyncio.timeout(seconds):
                    await event.wait()
        except TimeoutError:
            return
        finally:
            with self._lock:
                self._waiting, self._rung = None, False


@asynccontextmanager
async def beside(work: Coroutine[None, None, None]) -> AsyncIterator[None]:
    """Do this work for as long as the block lasts; at its end it is cancelled and waited for."""
    task = asyncio.create_task(work)
    try:
        yield
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


@asynccontextmanager
async def kept_up(
    some: Callable[[], int], *, at_once: int, pause: float, failed: str, wake: Wake | None = None
) -> AsyncIterator[None]:
    """Do what is due at start and regularly from then on, for as long as the block lasts.

    Args:
        some: does a part of what is due, and tells how many it did; blocks.
        at_once: how many it does at most: after so many it is asked again at once.
        pause: seconds until the next look otherwise.
        failed: what the log says of an error, after which the next look tries again. That a part of the service is away it
            says once for everybody, and the next look is soon.
        wake: ends the pause before its time.
    """
    async with beside(_regularly(some, at_once, pause, failed, wake or Wake())):
        yield


async def _regularly(some: Callable[[], int], at_once: int, pause: float, failed: str, wake: Wake) -> None:
    while True:
        done, until_next = 0, pause
        try:
            done = await run_in_threadpool(some)
        except PartAwayError:
            until_next = min(pause, RETRY_AFTER)
        except Exception:
            logger.exception(failed)
        if done < at_once:
            await wake.pause(until_next)
