"""Applies rules to checkpoints as they come, and removes those whose days are over."""

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from server.background import kept_up
from server.services import Services
from server.storage.service import StorageService

_PAUSE_SECONDS = 600.0
_AT_ONCE = 20


class StorageSweep:
    """Looks at experiments that have got checkpoints since the last look; at the first, at all."""

    def __init__(self, services: Services) -> None:
        self._storage = StorageService(services)
        self._seen = 0.0

    def sweep(self, now: float) -> int:
        """Some of what is due; how many experiments or checkpoints that were. Blocks."""
        applied, self._seen = self._storage.apply_to_new(self._seen, _AT_ONCE)
        return max(applied, self._storage.remove_due(now, _AT_ONCE))


@asynccontextmanager
async def keep_thinned(services: Services) -> AsyncIterator[None]:
    """Sweep at start, every ten minutes, and when somebody frees space, for as long as the block lasts."""
    sweep = StorageSweep(services)
    async with kept_up(
        lambda: sweep.sweep(time.time()),
        at_once=_AT_ONCE,
        pause=_PAUSE_SECONDS,
        wake=services.storage_wake,
        failed="rules for checkpoints could not be applied: the next sweep tries again",
    ):
        yield
