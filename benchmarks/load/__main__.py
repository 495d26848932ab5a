"""What one server carries: reporting runs, browsers with a stream and a page every ten seconds, watched runs with frames.

The server has one core to itself; the load, and PostgreSQL where that is the database, have the others. The runs are
synthetic, their link to the server is the real one. A page is all its requests side by side, timed until the last answer.

    python -m benchmarks.load --database sqlite --check
    python -m benchmarks.load --database postgresql --check
"""

import signal
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import psutil

from benchmarks.load.answers import answered
from benchmarks.load.meter import Meter
from benchmarks.load.plan import PagesTold, Plan, StreamsTold, ViewsTold, WorkersTold
from benchmarks.load.served import TOKEN, WORKER_TOKEN, Database, Part, cores, launch, server_on_a_core
from benchmarks.report import finish, parser

MAX_PAGE_MILLISECONDS = 300.0
# Flat: over the second half the memory grows by no more than this part of itself.
MAX_GROWTH_PERCENT = 3.0
# Of the 30 frames a second that a view aims at.
MIN_VIEW_FRAMES = 27.0


def load(
    *,
    database: Database,
    runs: int,
    series: int,
    batches: float,
    browsers: int,
    views: int,
    seconds: float,
    page_seconds: float = 10.0,
    history: int = 0,
) -> dict[str, object]:
    """Make the load for a while; the figures."""
    own, others = cores()
    with (
        TemporaryDirectory(prefix="mapless-load-") as directory,
        server_on_a_core(Path(directory), database, (own, others)) as server,
        ExitStack() as started,
    ):
        url, pid = server
        run_ids, experiment_ids = launch(url, runs)
        plan = Plan(
            server_url=url,
            token=TOKEN,
            worker_token=WORKER_TOKEN,
            run_ids=run_ids,
            experiment_ids=experiment_ids,
            series=series,
            batches=batches,
            history=history,
            browsers=browsers,
            page_seconds=page_seconds,
            views=views,
            seconds=seconds,
        )
        # The pages' clock must not wait for a turn on a core that the others keep busy.
        parts = []
        for niceness, command in (
            (5, ("benchmarks.load.workers",)),
            (5, ("benchmarks.load.browsers", "streams")),
            (5, ("benchmarks.load.views",)),
            (0, ("benchmarks.load.browsers", "pages")),
        ):
            parts.append(Part(plan, others, niceness, *command))
            started.callback(parts[-1].kill)
        patience = seconds + 120.0
        for part in parts:
            part.await_readiness()
        meter = Meter(pid)
        before = answered(url)
        clients_before = psutil.cpu_times(percpu=True)
        end = time.time() + seconds
        for part in parts:
            part.begin(end)
        workers = parts[0].told(WorkersTold, patience)
        streams = parts[1].told(StreamsTold, patience)
        watched = parts[2].told(ViewsTold, patience)
        pages = parts[3].told(PagesTold, patience)
        answers = answered(url) - before
        started.close()
        idle = sum(
            after.idle - before.idle
            for core, (before, after) in enumerate(zip(clients_before, psutil.cpu_times(percpu=True), strict=True))
            if core in others
        )
        cpu = meter.close()
        loop = meter.event_loop
        mean_memory, slope = meter.second_half()
        errors = {**workers.errors, **{f"page: {text}": count for text, count in pages.errors.items()}}
        return {
            "database": database,
            "runs": runs,
            "browsers": browsers,
            "views": views,
            "minutes": round(seconds / 60.0, 2),
            "batches_per_second": round(workers.acknowledged / seconds, 1),
            "leases_lost": workers.leases_lost,
            "items_not_acknowledged": workers.items - workers.acknowledged,
            "pages": len(pages.seconds),
            "page_p50_milliseconds": _percentile(pages.seconds, 50),
            "page_p95_milliseconds": _percentile(pages.seconds, 95),
            "page_p95_milliseconds_by_tenth": _by_tenth(pages, seconds),
            "page_milliseconds_by_route": {
                route: {**spread(took), "server": answers.milliseconds(route)}
                for route, took in sorted(pages.routes.items())
            },
            "pages_asked_again": pages.asked_again,
            "clients": {
                name: {
                    "core_percent": round(100.0 * told.processor_seconds / seconds, 1),
                    "lag_milliseconds": spread(told.lags),
                }
                for name, told in (("workers", workers), ("streams", streams), ("views", watched), ("pages", pages))
            },
            "memory_peak_megabytes": round(meter.peak_megabytes, 1),
            "memory_slope_megabytes_per_hour": round(slope, 1),
            "memory_growth_percent": round(100.0 * slope * seconds / 2 / 3600.0 / mean_memory, 2),
            "server_cpu_milliseconds_per_batch": round(1000.0 * cpu / max(1, workers.acknowledged), 2),
            "server_event_loop_percent": round(100.0 * loop / seconds, 1),
            "server_core_percent": round(100.0 * cpu / seconds, 1),
            "clients_idle_percent": round(100.0 * idle / len(others) / seconds, 1),
            "frames_sent": workers.frames,
            "view_frames_per_second": round(watched.messages / watched.seconds, 1) if watched.seconds else 0.0,
            "stream_megabytes": round(streams.bytes / 2**20, 1),
            "streams_and_views_that_ended": streams.ended + watched.ended,
            "errors": sum(errors.values()),
            "errors_by_text": errors,
        }


def spread(seconds: list[float]) -> dict[str, float]:
    """Milliseconds: the median, the 95th and 99th percentiles and the most; how many there are."""
    return {
        "count": len(seconds),
        **{f"p{share}": _percentile(seconds, share) for share in (50, 95, 99)},
        "most": _percentile(seconds, 100),
    }


def _by_tenth(pages: PagesTold, seconds: float) -> list[float]:
    """The 95th percentiles of the pages that were opened in each tenth of the time: what comes now and then shows."""
    tenths: list[list[float]] = [[] for _ in range(10)]
    for opened, took in zip(pages.opened, pages.seconds, strict=True):
        tenths[min(9, max(0, int(10.0 * opened / seconds)))].append(took)
    return [_percentile(tenth, 95) for tenth in tenths]


def _percentile(seconds: list[float], share: int) -> float:
    return round(1000.0 * float(np.percentile(seconds, share)), 1) if seconds else 0.0


def main() -> None:
    """Measure and print."""
    options = parser(__doc__)
    options.add_argument("--database", choices=("sqlite", "postgresql"), default="sqlite")
    options.add_argument("--runs", type=int, default=100)
    options.add_argument("--series", type=int, default=43, help="in each report")
    options.add_argument("--batches", type=float, default=2.0, help="reports a second of each run")
    options.add_argument("--history", type=int, default=0, help="points of each series that were reported before")
    options.add_argument("--browsers", type=int, default=200)
    options.add_argument("--views", type=int, default=20)
    options.add_argument("--minutes", type=float, default=10.0)
    arguments = options.parse_args()
    # What was started is ended, however this ends.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    figures = load(
        database=arguments.database,
        runs=arguments.runs,
        series=arguments.series,
        batches=arguments.batches,
        history=arguments.history,
        browsers=arguments.browsers,
        views=arguments.views,
        seconds=60.0 * arguments.minutes,
    )
    finish(
        "load",
        figures,
        at_least={"view_frames_per_second": MIN_VIEW_FRAMES} if arguments.views else {},
        at_most={
            "leases_lost": 0.0,
            "items_not_acknowledged": 0.0,
            "page_p95_milliseconds": MAX_PAGE_MILLISECONDS,
            "memory_growth_percent": MAX_GROWTH_PERCENT,
            "errors": 0.0,
            "streams_and_views_that_ended": 0.0,
        },
        check=arguments.check,
    )


if __name__ == "__main__":
    main()
