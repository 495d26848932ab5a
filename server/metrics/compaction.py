"""Compacts rows of metrics beside everything else: one run at a time, with pauses between them.

Runs that were launched together have reported equally much: a hundred are due in the same second, which are ten seconds of a
core. Within the transactions that store reports, workers and pages would wait for all of them.
"""

import asyncio
import logging
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from server.background import beside
from server.errors import DatabaseBusyError, PartAwayError
from server.metrics.repository import MetricRepository
from server.outage import RETRY_AFTER
from server.runs.repository import RunRepository
from server.services import Services

logger = logging.getLogger(__name__)

# So many times as long as a compaction took nothing is compacted: it takes a thirteenth of a core, for which there is room
# beside a hundred runs and their pages; a quarter once so many runs wait that rows would pile up.
_REST, _REST_OF_MANY, _MANY = 12.0, 3.0, 200
# Until the next look, where nobody rings.
_LOOK_SECONDS = 600.0


def compact(services: Services, run_id: str) -> None:
    """Move a run's rows into chunks, if enough of them wait; blocks.

    Raises:
        DatabaseAwayError, DatabaseBusyError: not now.
    """
    with services.database.write() as session:
        # Who reports on it waits: rows that came in between would go with those that were read.
        locked = RunRepository(session).several([run_id], for_update=True)
        metrics = MetricRepository(session)
        if locked and metrics.needs_compaction(run_id):
            metrics.compact(run_id)


@asynccontextmanager
async def keep_compacted(services: Services) -> AsyncIterator[None]:
    """Compact what has grown for as long as the block lasts; what is due when it ends is due again by its next reports."""
    async with beside(_compact_all(services)):
        yield


async def _compact_all(services: Services) -> None:
    while True:
        run_id = services.grown.take()
        if run_id is None:
            await services.grown.wake.pause(_LOOK_SECONDS)
            continue
        began = time.monotonic()
        try:
            await services.lanes.compaction.run(compact, services, run_id)
        except (PartAwayError, DatabaseBusyError):
            services.grown.add([run_id])
            await asyncio.sleep(RETRY_AFTER)
        except Exception:
            logger.exception("the points of run %s could not be compacted: they are looked at again as it reports", run_id)
        await asyncio.sleep(rest(len(services.grown)) * (time.monotonic() - began))


def rest(waiting: int) -> float:
    """How long nothing is compacted while so many runs wait, in compactions' times."""
    return _REST if waiting < _MANY else _REST_OF_MANY
