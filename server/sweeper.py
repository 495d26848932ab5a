"""What keeps runs from being forgotten: leases that run out, and messages that got lost."""

import asyncio
import contextlib
import logging
import time
from collections import defaultdict
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from starlette.concurrency import run_in_threadpool

from server.doorbell import CeleryDoorbell, prepare_broker
from server.experiments.stored import training_of
from server.runs.repository import RunRepository
from server.services import Services
from server.system.repository import WorkerRepository
from server.worker_api.links import OpenLinks
from server.worker_api.service import WorkerService
from workers.protocol import HEARTBEAT_SECONDS, queue_of

logger = logging.getLogger(__name__)

_SWEEPS_PER_LEASE = 5
# A run that waits although a worker is idle is rung again after this long: its message was lost.
RING_AGAIN_SECONDS = 10.0
# A worker is there if it was heard of within so many heartbeats.
_HEARTBEATS = 3


class Sweeper:
    """Looks at all runs at regular intervals; the clock is the caller's, so that time can be told in a test."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._service = WorkerService(services)
        self._lease_seconds = services.settings.lease_seconds
        self._swept_at: float | None = None
        self._rung_at: dict[str, float] = {}

    @property
    def interval(self) -> float:
        """Seconds between two sweeps."""
        return self._lease_seconds / _SWEEPS_PER_LEASE

    def sweep(self, now: float) -> None:
        """One look at everything.

        After a time in which nobody swept (the server was down, the laptop asleep) the workers could not have been heard, so
        their leases are prolonged first.
        """
        first = self._swept_at is None
        if self._swept_at is None or now - self._swept_at > self._lease_seconds / 2:
            self._extend_leases(now)
        else:
            self._service.lose_expired(now)
        self._swept_at = now
        self._ring_again(now, everybody=first)

    def _extend_leases(self, now: float) -> None:
        with self._services.database.write() as session:
            RunRepository(session).extend_leases(now + self._lease_seconds)

    def _ring_again(self, now: float, *, everybody: bool) -> None:
        """Ring for runs that wait although somebody could train them; at start for all that wait."""
        with self._services.database.read() as session:
            waiting = RunRepository(session).queued()
            idle = WorkerRepository(session).idle_by_queue(now - _HEARTBEATS * HEARTBEAT_SECONDS)
        rung: dict[str, int] = defaultdict(int)
        for run in waiting:
            queue = queue_of(training_of(run.experiment))
            quiet_since = max(run.queued_at, self._rung_at.get(run.id, 0.0))
            overdue = now - quiet_since >= RING_AGAIN_SECONDS and rung[queue] < idle.get(queue, 0)
            if everybody or overdue:
                self._rung_at[run.id] = now
                self._services.doorbell.ring(run.id, run.attempt, queue)
                rung[queue] += 1
        known = {run.id for run in waiting}
        self._rung_at = {run_id: at for run_id, at in self._rung_at.items() if run_id in known}


@asynccontextmanager
async def dispatch(services: Services) -> AsyncIterator[None]:
    """Reach workers for as long as the block lasts: doorbell, links and sweeper."""
    broker_url, prefix = services.settings.resolved_broker_url, services.settings.queue_prefix
    await run_in_threadpool(prepare_broker, broker_url, prefix)
    doorbell = CeleryDoorbell(broker_url, prefix)
    services.doorbell = doorbell
    services.links = OpenLinks(asyncio.get_running_loop())
    task = asyncio.create_task(_sweep_regularly(Sweeper(services)))
    try:
        yield
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
        await run_in_threadpool(doorbell.close)


async def _sweep_regularly(sweeper: Sweeper) -> None:
    while True:
        try:
            await run_in_threadpool(sweeper.sweep, time.time())
        except Exception:
            # Leases must expire for all runs, whatever is wrong with one of them, or with the database for a while.
            logger.exception("a sweep failed: the next one tries again")
        await asyncio.sleep(sweeper.interval)
