"""Work that the server does by itself, a little at a time, for as long as it runs."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from starlette.concurrency import run_in_threadpool

logger = logging.getLogger(__name__)


@asynccontextmanager
async def kept_up(some: Callable[[], int], *, at_once: int, pause: float, failed: str) -> AsyncIterator[None]:
    """Do what is due at start and regularly from then on, for as long as the block lasts.

    Args:
        some: does a part of what is due, and tells how many it did; blocks.
        at_once: how many it does at most: after so many it is asked again at once.
        pause: seconds until the next look otherwise.
        failed: what the log says of an error, after which the next look tries again.
    """
    task = asyncio.create_task(_regularly(some, at_once, pause, failed))
    try:
        yield
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


async def _regularly(some: Callable[[], int], at_once: int, pause: float, failed: str) -> None:
    while True:
        done = 0
        try:
            done = await run_in_threadpool(some)
        except Exception:
            logger.exception(failed)
        if done < at_once:
            await asyncio.sleep(pause)
