"""How things stand, gathered when Prometheus asks."""

import shutil
import time
from collections.abc import Iterator
from functools import lru_cache
from typing import get_args

from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from sqlalchemy.exc import SQLAlchemyError

from server.database.tables import RunState
from server.errors import NotFoundError, PartAwayError
from server.experiments.repository import ExperimentRepository
from server.experiments.stored import training_of
from server.monitoring.repository import MonitoringRepository
from server.runs.repository import RunRepository
from server.services import Services
from server.system.service import workers_lately
from workers.protocol import Queue, queues_of

# An experiment's queue never changes, and finding it reads its whole configuration.
_REMEMBERED = 4096
# Sums over all checkpoints, and sizes, are looked at once in so long.
_SIZES_SECONDS = 60.0


class StateCollector(Collector):
    """The state of a service as gauges; blocks, and is asked by one thread at a time.

    Args:
        services: to look at.
    """

    def __init__(self, services: Services) -> None:
        self._services = services
        self._queue_of = lru_cache(_REMEMBERED)(self._look_up_queue)
        self._sizes: tuple[float, dict[str, int]] | None = None

    def describe(self) -> Iterator[Metric]:
        """Nothing: what there is may need a database that is away when the collector is registered."""
        return iter(())

    def collect(self) -> Iterator[Metric]:
        """All gauges; those that need the database are left out while it is away, and `mapless_database_up` is 0."""
        yield from self._of_process()
        up = GaugeMetricFamily("mapless_database_up", "Whether the database answers.")
        try:
            families = list(self._of_database())
        except (SQLAlchemyError, PartAwayError):
            families = []
        up.add_metric([], float(bool(families)))
        yield up
        yield from families

    def _of_process(self) -> Iterator[Metric]:
        services = self._services
        yield _gauge("mapless_event_streams", "Pages that listen for changes.", services.bus.listeners)
        yield _gauge("mapless_live_views", "Live views that are open.", services.live.open_scenes)
        yield _gauge("mapless_live_watchers", "Browsers that watch a live view.", services.live.watchers)
        yield _gauge("mapless_sweep_age_seconds", "Since the sweeper last got round.", services.pulse.age)
        disk = shutil.disk_usage(services.settings.data_dir)
        yield _gauge("mapless_disk_free_bytes", "Free on the disk of the data directory.", disk.free)
        busy = GaugeMetricFamily("mapless_lane_busy", "Work that is under way, by kind.", labels=("lane",))
        waiting = GaugeMetricFamily("mapless_lane_waiting", "Work that waits for a thread, by kind.", labels=("lane",))
        refused = GaugeMetricFamily("mapless_lane_refused", "Work that found its queue full, by kind.", labels=("lane",))
        for lane in services.lanes.all():
            busy.add_metric([lane.name], lane.busy)
            waiting.add_metric([lane.name], lane.waiting)
            refused.add_metric([lane.name], lane.refused)
        yield from (busy, waiting, refused)

    def _of_database(self) -> Iterator[Metric]:
        with self._services.database.read() as session:
            counts = RunRepository(session).count_by_state()
            experiments = MonitoringRepository(session).waiting()
            workers = workers_lately(session)
            sizes = self._look_up_sizes(MonitoringRepository(session))
        runs = GaugeMetricFamily("mapless_runs", "Runs by state.", labels=("state",))
        for state in get_args(RunState):
            runs.add_metric([state], counts.get(state, 0))
        yield runs
        now = time.time()
        depth, wait, there = (dict.fromkeys(get_args(Queue), 0.0) for _ in range(3))
        for identifier, count, since in experiments:
            try:
                queue = self._queue_of(identifier)
            except NotFoundError:  # deleted a moment ago
                continue
            depth[queue] += count
            wait[queue] = max(wait[queue], now - since)
        for worker in workers:
            there[worker.queue] += 1
        for name, text, values in (
            ("mapless_queue_depth", "Runs that wait for a worker, by queue.", depth),
            ("mapless_queue_wait_seconds", "How long the first of them has waited, by queue.", wait),
            ("mapless_workers", "Workers that were heard of lately, by queue.", there),
        ):
            family = GaugeMetricFamily(name, text, labels=("queue",))
            for queue, value in values.items():
                family.add_metric([queue], value)
            yield family
        yield _gauge("mapless_store_bytes", "Size of all checkpoints in the store.", sizes["store"])
        yield _gauge("mapless_database_bytes", "Size of the database.", sizes["database"])

    def _look_up_queue(self, experiment_id: str) -> Queue:
        with self._services.database.read() as session:
            # One that any worker may take is counted once.
            return queues_of(training_of(ExperimentRepository(session).get(experiment_id)))[0]

    def _look_up_sizes(self, repository: MonitoringRepository) -> dict[str, int]:
        now = time.monotonic()
        if self._sizes is None or now - self._sizes[0] > _SIZES_SECONDS:
            self._sizes = now, {"store": repository.store_bytes(), "database": repository.database_bytes()}
        return self._sizes[1]


def _gauge(name: str, text: str, value: float) -> GaugeMetricFamily:
    return GaugeMetricFamily(name, text, value=value)
