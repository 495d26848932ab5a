"""What was deleted lies in the trash for a week, then goes for good, files and all."""

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from server.background import kept_up
from server.experiments.repository import ExperimentRepository
from server.experiments.service import ExperimentService
from server.services import Services

_PAUSE_SECONDS = 600.0
_AT_ONCE = 5


def empty_trash(services: Services, now: float) -> int:
    """Remove some of what has lain in the trash for too long; how many there were. Blocks."""
    limit = now - services.settings.trash_days * 86_400
    with services.database.read() as session:
        due = ExperimentRepository(session).deleted_before(limit, _AT_ONCE)
    for experiment_id in due:
        ExperimentService(services).remove(experiment_id)
    return len(due)


@asynccontextmanager
async def keep_emptied(services: Services) -> AsyncIterator[None]:
    """Empty the trash of what is due at start and every ten minutes, for as long as the block lasts."""
    async with kept_up(
        lambda: empty_trash(services, time.time()),
        at_once=_AT_ONCE,
        pause=_PAUSE_SECONDS,
        failed="the trash could not be emptied: the next try is in ten minutes",
    ):
        yield
