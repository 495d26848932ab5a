"""What keeps runs from being forgotten: leases that run out, and messages that got lost."""

import asyncio
import logging
import time
from collections import defaultdict
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from starlette.concurrency import run_in_threadpool

from server.background import beside
from server.doorbell import CeleryDoorbell, prepare_broker
from server.errors import PartAwayError
from server.experiments.stored import training_of
from server.jobs.service import JobService
from server.runs import states
from server.runs.repository import RunRepository
from server.runs.shares import ShareRepository
from server.services import Services
from server.system.repository import SILENCE_SECONDS, WorkerRepository, versions_on
from server.worker_api.ingest import Ingest
from server.worker_api.leases import Attempt
from server.worker_api.links import OpenLinks
from server.worker_api.service import WorkerService
from sim.extending.discovery import missing
from workers.protocol import queues_of

logger = logging.getLogger(__name__)

_SWEEPS_PER_LEASE = 5
# A run that waits although a worker is idle is rung again after this long: its message was lost.
RING_AGAIN_SECONDS = 3.0
# Between two looks at what has ended long ago.
_FORGET_SECONDS = 600.0


class Sweeper:
    """Looks at all runs at regular intervals.

    Args:
        services: of the server.
        clock: seconds that only grow, however the wall clock is set.
    """

    def __init__(self, services: Services, clock: Callable[[], float] = time.monotonic) -> None:
        self._services = services
        self._clock = clock
        self._service = WorkerService(services)
        self._jobs = JobService(services)
        self._forgot_at = 0.0
        self._lease_seconds = services.settings.lease_seconds
        self._swept_at: float | None = None
        self._rung_all = False
        self._quiet_since: dict[Attempt, float] = {}

    @property
    def interval(self) -> float:
        """Seconds between two sweeps."""
        return self._lease_seconds / _SWEEPS_PER_LEASE

    def sweep(self) -> None:
        """One look at everything.

        After a time in which nobody swept (the server was stopped, the laptop asleep) the workers could not have been heard,
        so they all have a whole lease again.
        """
        now = self._clock()
        if self._swept_at is not None and now - self._swept_at > self._lease_seconds / 2:
            self._services.leases.renew_all()
            self._services.job_leases.renew_all()
        self._swept_at = now
        self._service.lose_expired()
        self._jobs.lose_expired()
        if not self._rung_all or now - self._forgot_at > _FORGET_SECONDS:
            self._jobs.forget_old()
            self._forgot_at = now
        self._ring_again(now, everybody=not self._rung_all)
        self._rung_all = True

    def _ring_again(self, now: float, *, everybody: bool) -> None:
        """Ring for runs that wait although somebody could train them; at start for all that wait."""
        moment = time.time()
        with self._services.database.read() as session:
            waiting = RunRepository(session).queued()
            shares = ShareRepository(session).read(self._services.settings.limits)
            idle = [
                (worker.queue, versions_on(worker))
                for worker in WorkerRepository(session).idle(moment - SILENCE_SECONDS, moment)
            ]
        # Whoever queued a run has rung for it: one that is new here was rung a moment ago.
        quiet_since = {(run.id, run.attempt): self._quiet_since.get((run.id, run.attempt), now) for run in waiting}
        rung: dict[str, int] = defaultdict(int)
        for run in waiting:
            # Once the limit allows it, it has waited long enough already.
            if shares.waits_for(run) is not None:
                continue
            quiet = now - quiet_since[run.id, run.attempt]
            training = training_of(run.experiment)
            for queue in queues_of(training, run.device):
                takers = sum(there == queue and not missing(training.extensions, has) for there, has in idle)
                if everybody or (quiet >= RING_AGAIN_SECONDS and rung[queue] < takers):
                    quiet_since[run.id, run.attempt] = now
                    self._services.doorbell.ring(run.id, run.attempt, queue)
                    rung[queue] += 1
        self._quiet_since = quiet_since


@asynccontextmanager
async def dispatch(services: Services) -> AsyncIterator[None]:
    """Reach workers for as long as the block lasts: doorbell, links and sweeper."""
    broker_url, prefix = services.settings.resolved_broker_url, services.settings.queue_prefix
    await run_in_threadpool(prepare_broker, broker_url, prefix)
    await run_in_threadpool(_say_what_is_found, services)
    # Nobody has a view open of a server that starts.
    for kind in ("view", "play"):
        await run_in_threadpool(JobService(services).cancel_all, kind)
    doorbell = CeleryDoorbell(broker_url, prefix)
    services.doorbell = doorbell
    ingest = Ingest(WorkerService(services).receive)
    services.links = OpenLinks(asyncio.get_running_loop(), ingest)
    try:
        async with beside(_sweep_regularly(services)):
            yield
    finally:
        await ingest.close()
        await run_in_threadpool(doorbell.close)


def _say_what_is_found(services: Services) -> None:
    """What a server that starts finds of the one before it, and what becomes of that."""
    with services.database.read() as session:
        counts = RunRepository(session).count_by_state()
    under_way = sum(counts.get(state, 0) for state in states.ACTIVE)
    if under_way:
        logger.info(
            "Runs under way: %d. Their workers have %g s to be heard of; whose is not goes back into the queue.",
            under_way,
            services.settings.lease_seconds,
        )
    if waiting := counts.get("queued", 0):
        logger.info("Runs that wait for a worker: %d.", waiting)


async def _sweep_regularly(services: Services) -> None:
    sweeper = Sweeper(services)
    while True:
        try:
            await services.lanes.sweeper.run(sweeper.sweep)
            services.pulse.beat()
        except PartAwayError:
            # The log says so already.
            pass
        except Exception:
            # Leases must expire for all runs, whatever is wrong with one of them, or with the database for a while.
            logger.exception("a sweep failed: the next one tries again")
        await asyncio.sleep(sweeper.interval)
