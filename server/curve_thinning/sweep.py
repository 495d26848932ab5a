"""Applies rules to curves of runs that have ended, a piece at a time."""

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from server.background import kept_up
from server.curve_thinning.service import CurveThinningService
from server.services import Services

_PAUSE_SECONDS = 600.0
_AT_ONCE = 20


def sweep(services: Services, now: float) -> bool:
    """Some of what is due; whether more may be. Blocks."""
    service = CurveThinningService(services)
    service.spare_some()
    marked = service.mark_some(now, _AT_ONCE)
    return service.thin_some(now) > 0 or marked == _AT_ONCE


@asynccontextmanager
async def keep_curves_thinned(services: Services) -> AsyncIterator[None]:
    """Sweep at start, every ten minutes, and when somebody changes a rule, for as long as the block lasts."""
    async with kept_up(
        lambda: int(sweep(services, time.time())),
        at_once=1,
        pause=_PAUSE_SECONDS,
        wake=services.curves_wake,
        failed="rules for curves could not be applied: the next sweep tries again",
    ):
        yield
