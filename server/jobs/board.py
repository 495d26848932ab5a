"""What the server knows of jobs from one moment to the next: who waits for one, who for its end, how far it is.

None of it outlives the server: rows say what there is to do, and whoever still wants something asks again.
"""

import asyncio
import contextlib
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Coroutine, Iterable, Iterator, Mapping, Sequence
from typing import Any

from server.worker_api.losses import machine_of
from sim.extending.discovery import UsedExtension, missing

# A worker that has not asked for a job for as long has gone, or all of its places are taken.
_LATELY_SECONDS = 30.0


class Board:
    """Brings together who asks for jobs and who does them.

    Waiting is on the event loop; `ring` and `end` come from any thread.
    """

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._bells: set[asyncio.Event] = set()
        self._ends: defaultdict[str, set[asyncio.Event]] = defaultdict(set)
        self._askers: Counter[str] = Counter()
        self._heard: dict[str, tuple[float, Mapping[str, str | None]]] = {}
        self._progress: dict[str, tuple[int, float]] = {}
        self._ahead: set[str] = set()
        self._tasks: set[asyncio.Task[object]] = set()
        self.closed = False

    def close(self) -> None:
        """The server ends: nobody waits for work, or for its end, any more. On the event loop."""
        self.closed = True
        _set(self._bells)
        for events in self._ends.values():
            _set(events)

    def start(self, work: Coroutine[Any, Any, object]) -> None:
        """Do something that must be done although its asker has left. On the event loop."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # -- workers ----------------------------------------------------------------------------------------------------------

    def heard(self, worker: str, extensions: Mapping[str, str | None] | None = None) -> None:
        """A worker has asked for a job; its extensions are names to versions."""
        now = time.monotonic()
        self._heard[worker] = now, extensions or {}
        if len(self._heard) > 1_000:
            self._heard = {name: said for name, said in self._heard.items() if now - said[0] < _LATELY_SECONDS}

    def workers(self, needed: Sequence[UsedExtension] = ()) -> list[str]:
        """Those that were heard of lately, and have what is needed."""
        now = time.monotonic()
        said = tuple(self._heard.items())
        return [name for name, (at, there) in said if now - at < _LATELY_SECONDS and not missing(needed, there)]

    def machines(self) -> int:
        """How many workers there are, whatever places each has."""
        return len({machine_of(name) for name in self.workers()})

    @contextlib.contextmanager
    def listening(self) -> Iterator[asyncio.Event]:
        """The event is set whenever a job has come, from before the block's first look at what there is."""
        self._loop = asyncio.get_running_loop()
        bell = asyncio.Event()
        self._bells.add(bell)
        try:
            yield bell
        finally:
            self._bells.discard(bell)

    def ring(self) -> None:
        """A job waits."""
        self._call(lambda: _set(self._bells))

    def take(self, job_id: str, attempt: int, *, ahead: bool = False) -> None:
        """A worker has the job; `ahead`: which nobody waits for."""
        self._progress[job_id] = attempt, 0.0
        if ahead:
            self._ahead.add(job_id)

    def report(self, job_id: str, attempt: int, progress: float) -> None:
        """Its worker says how far it is."""
        self._progress[job_id] = attempt, progress

    def is_current(self, job_id: str, attempt: int) -> bool:
        """Whether this attempt is known to be under way; False where the database must be asked."""
        return self._progress.get(job_id, (0, 0.0))[0] == attempt

    def is_ahead(self, job_id: str) -> bool:
        """Whether a worker has the job although nobody waited for it."""
        return job_id in self._ahead

    def progress(self, job_id: str) -> float:
        """Share of a job that is done, 0 to 1."""
        return self._progress.get(job_id, (0, 0.0))[1]

    def leave(self, job_id: str) -> None:
        """No worker has the job any more."""
        self._progress.pop(job_id, None)
        self._ahead.discard(job_id)

    # -- those who ask ----------------------------------------------------------------------------------------------------

    @contextlib.contextmanager
    def asking(self, job_id: str) -> Iterator[asyncio.Event]:
        """Somebody waits for a job, as long as the block lasts; the event is set once it has ended."""
        self._loop = asyncio.get_running_loop()
        ended = asyncio.Event()
        self._ends[job_id].add(ended)
        self._askers[job_id] += 1
        try:
            yield ended
        finally:
            self._askers[job_id] -= 1
            self._ends[job_id].discard(ended)
            if not self._askers[job_id]:
                del self._askers[job_id], self._ends[job_id]

    def wanted(self, job_id: str) -> bool:
        """Whether anybody waits for it."""
        return job_id in self._askers

    def end(self, job_id: str) -> None:
        """The job has ended, however it did."""
        self.leave(job_id)
        self._call(lambda: _set(self._ends.get(job_id, ())))

    def _call(self, callback: Callable[[], object]) -> None:
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(callback)


def _set(events: Iterable[asyncio.Event]) -> None:
    for event in events:
        event.set()
