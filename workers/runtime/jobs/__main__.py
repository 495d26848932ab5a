"""`python -m workers.runtime.jobs PLACES`: takes up jobs until SIGTERM; `mapless worker` starts it.

Most places take all of it, the first only what takes seconds: what somebody waits for, and short evaluations behind it.
So an evaluation of minutes keeps nothing waiting that is short. Views, which last as long as somebody looks and cost little,
have places of their own.
"""

import logging
import os
import signal
import sys
import threading
import time
from typing import NamedTuple

from workers.errors import UnfitError
from workers.job_protocol import KINDS, JobKind
from workers.logs import configure
from workers.protocol import HEARTBEAT_SECONDS
from workers.runtime.fitness import Fitness, make_private
from workers.runtime.jobs.client import JobClient
from workers.runtime.jobs.forks import Forks
from workers.runtime.jobs.place import Place
from workers.runtime.nursery_keeper import DOOR, NurseryKeeper, door
from workers.runtime.settings import WorkerSettings
from workers.runtime.sight import ServerSight
from workers.runtime.supervised import end_with_supervisor

_VIEWS: tuple[JobKind, ...] = ("view", "play")
_ALL_BUT_VIEWS: tuple[JobKind, ...] = tuple(kind for kind in KINDS if kind not in _VIEWS)
# Of finished policies that are watched or played with at a time; each takes a few per cent of a core.
VIEW_PLACES = 4
# Time to hand back what is under way.
_END_SECONDS = 3.0


class Takes(NamedTuple):
    """What a place takes: kinds of jobs, and whether those too that go on for minutes."""

    kinds: tuple[JobKind, ...]
    long: bool


def places(count: int) -> list[Takes]:
    """What each place takes; `count` of them beside those for views. The only one takes everything."""
    first = Takes(_ALL_BUT_VIEWS, long=count == 1)
    return [first, *[Takes(_ALL_BUT_VIEWS, long=True)] * (count - 1), *[Takes(_VIEWS, long=False)] * VIEW_PLACES]


def main(count: int) -> None:
    """Take up jobs until SIGTERM or SIGINT; what is under way then is handed back."""
    end_with_supervisor()
    settings = WorkerSettings()
    configure(settings.log_format)
    logging.getLogger("httpx").setLevel(logging.WARNING)
    os.umask(0o077)
    try:
        make_private(settings.work_dir)
    except UnfitError as error:
        sys.exit(f"mapless: {error}")
    ending = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: ending.set())
    # The worker's where it has one; its imports take seconds, so one of its own begins at once.
    keeper = None if DOOR in os.environ else NurseryKeeper()
    forks = Forks(door() if keeper is None else keeper.door)
    client = JobClient(settings.server_url, settings.worker_token.get_secret_value())
    fitness = Fitness(settings.work_dir, settings.min_free_bytes)
    sight = ServerSight(settings.server_url)
    threads = []
    for index, takes in enumerate(places(count)):
        name = f"{settings.host_name}/jobs{index}"
        place = Place(name, takes.kinds, takes.long, client, settings.work_dir, fitness, sight, forks, ending)
        threads.append(threading.Thread(target=place.run, name=place.name, daemon=True))
        threads[-1].start()
    if keeper is not None:
        keeper.keep_running()
    while not ending.wait(HEARTBEAT_SECONDS):
        fitness.say(fitness.trouble)
    deadline = time.monotonic() + _END_SECONDS
    for thread in threads:
        thread.join(max(0.0, min(_END_SECONDS, deadline - time.monotonic())))
    # A place that waits for a job hears nothing else, and has nothing to hand back.
    os._exit(0)


if __name__ == "__main__":
    main(int(sys.argv[1]))
