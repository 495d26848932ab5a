"""`python -m workers.runtime.jobs PLACES`: takes up jobs until SIGTERM; `mapless worker` starts it.

Most places take what somebody waits for and what nobody does alike, the first only the former, so that an evaluation never
keeps a replay waiting; views, which last as long as somebody looks and cost little, have places of their own.
"""

import logging
import os
import signal
import sys
import threading
import time
from multiprocessing.forkserver import ensure_running

from workers.errors import UnfitError
from workers.job_protocol import KINDS, JobKind
from workers.logs import configure
from workers.protocol import HEARTBEAT_SECONDS
from workers.runtime.fitness import Fitness, make_private
from workers.runtime.jobs.client import JobClient
from workers.runtime.jobs.place import Place, forkserver
from workers.runtime.settings import WorkerSettings
from workers.runtime.sight import ServerSight
from workers.runtime.supervised import end_with_supervisor

_VIEWS: tuple[JobKind, ...] = ("view", "play")
_WAITED_FOR: tuple[JobKind, ...] = ("replay", "film", "bag", "export")
_ALL_BUT_VIEWS: tuple[JobKind, ...] = tuple(kind for kind in KINDS if kind not in _VIEWS)
# Of finished policies that are watched or played with at a time; each takes a few per cent of a core.
VIEW_PLACES = 4
# Time to hand back what is under way.
_END_SECONDS = 3.0


def kinds_of_places(count: int) -> list[tuple[JobKind, ...]]:
    """What each place takes; `count` of them beside those for views."""
    if count == 1:
        return [_ALL_BUT_VIEWS, *[_VIEWS] * VIEW_PLACES]
    return [_WAITED_FOR, *[_ALL_BUT_VIEWS] * (count - 1), *[_VIEWS] * VIEW_PLACES]


def main(count: int) -> None:
    """Take up jobs until SIGTERM or SIGINT; what is under way then is handed back."""
    end_with_supervisor()
    settings = WorkerSettings()
    configure(settings.log_format)
    logging.getLogger("httpx").setLevel(logging.WARNING)
    os.umask(0o077)
    os.environ.update(OMP_NUM_THREADS="1", MKL_NUM_THREADS="1", NUMBA_NUM_THREADS="1")
    try:
        make_private(settings.work_dir)
    except UnfitError as error:
        sys.exit(f"mapless: {error}")
    ending = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: ending.set())
    context = forkserver()
    # At once: imports take seconds.
    ensure_running()
    client = JobClient(settings.server_url, settings.worker_token.get_secret_value())
    fitness = Fitness(settings.work_dir, settings.min_free_bytes)
    sight = ServerSight(settings.server_url)
    threads = []
    for index, kinds in enumerate(kinds_of_places(count)):
        name = f"{settings.host_name}/jobs{index}"
        place = Place(name, kinds, client, settings.work_dir, fitness, sight, context, ending)
        threads.append(threading.Thread(target=place.run, name=place.name, daemon=True))
        threads[-1].start()
    while not ending.wait(HEARTBEAT_SECONDS):
        fitness.say(fitness.trouble)
    deadline = time.monotonic() + _END_SECONDS
    for thread in threads:
        thread.join(max(0.0, min(_END_SECONDS, deadline - time.monotonic())))
    # A place that waits for a job hears nothing else, and has nothing to hand back.
    os._exit(0)


if __name__ == "__main__":
    main(int(sys.argv[1]))
