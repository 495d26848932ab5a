"""How late a process that makes a part of the load is itself: what it tells of the server is known no better than that."""

import asyncio
import time

from benchmarks.load.plan import Plan

_INTERVAL_SECONDS = 0.05


async def watch_lag(plan: Plan, lags: list[float]) -> None:
    """Notes, until the end of the plan, by how many seconds the event loop takes up later what is due."""
    while not plan.over:
        due = time.perf_counter() + _INTERVAL_SECONDS
        await asyncio.sleep(_INTERVAL_SECONDS)
        lags.append(time.perf_counter() - due)


def watch_thread_lag(plan: Plan, lags: list[float]) -> None:
    """The same for a process of threads."""
    while not plan.over:
        due = time.perf_counter() + _INTERVAL_SECONDS
        time.sleep(_INTERVAL_SECONDS)
        lags.append(time.perf_counter() - due)
