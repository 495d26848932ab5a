"""Writes down the settings of experiments that another version stored, a few at a time, beside everything else."""

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from starlette.concurrency import run_in_threadpool

from server.background import beside
from server.outage import patiently
from server.services import Services
from server.workbench.keys import KeyRepository

logger = logging.getLogger(__name__)

# In one transaction: other writers wait for it.
_AT_ONCE = 20
_PAUSE_SECONDS = 0.05


def index_some(services: Services) -> int:
    """Write down the settings of some experiments that are due; how many there were. Blocks."""
    with services.database.read() as session:
        if not KeyRepository(session).due(1):
            return 0
    with services.database.write() as session:
        repository = KeyRepository(session)
        due = repository.due(_AT_ONCE)
        repository.write_down(due)
        return len(due)


@asynccontextmanager
async def keep_indexed(services: Services) -> AsyncIterator[None]:
    """Write down at start what is due; what is launched later writes itself down."""
    async with beside(_index_all(services)):
        yield


async def _index_all(services: Services) -> None:
    try:
        while True:
            if not await patiently(lambda: run_in_threadpool(index_some, services)):
                return
            await asyncio.sleep(_PAUSE_SECONDS)
    except Exception:
        logger.exception("older trainings cannot be filtered by their settings: the next start tries again")
