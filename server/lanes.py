"""Threads by kind of work, so that no kind keeps another waiting: who reads a page never stands behind an export.

What people ask for quickly runs on the framework's own threads. Everything else has a lane: so many at a time, a short queue
before it, and a refusal that says when to come again for whoever finds the queue full.
"""

from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass, field
from typing import TypeVar, TypeVarTuple

from anyio import CapacityLimiter, to_thread

from server.errors import BusyError

_T = TypeVar("_T")
_Args = TypeVarTuple("_Args")

# Seconds after which somebody who was refused may find a place.
_COME_AGAIN = 10.0


class Lane:
    """Work of one kind. Used on the event loop; the work itself is on threads.

    A caller that is cancelled while it waits leaves the queue, and its work never begins; work that has begun finds out by
    `anyio.from_thread.check_cancelled`.

    Args:
        name: of the kind, for people.
        threads: that many at a time.
        queue: that many may wait; None for any number.
    """

    def __init__(self, name: str, threads: int, queue: int | None = None) -> None:
        self.name = name
        self._threads = threads
        self._queue = queue
        self._limiter = CapacityLimiter(threads)
        self._inside = 0
        self.refused = 0

    @property
    def busy(self) -> int:
        """How many are at work."""
        return min(self._inside, self._threads)

    @property
    def waiting(self) -> int:
        """How many stand in the queue."""
        return max(0, self._inside - self._threads)

    async def run(self, work: Callable[[*_Args], _T], *arguments: *_Args) -> _T:
        """`work(*arguments)` on a thread of this lane.

        Raises:
            BusyError: as many wait as may.
            Exception: what `work` raises.
        """
        if self._queue is not None and self.waiting >= self._queue:
            self.refused += 1
            raise BusyError(
                f"The server is busy with other {self.name}: {self._queue} wait already. Try again in a moment.",
                retry_after=_COME_AGAIN,
            )
        self._inside += 1
        try:
            return await to_thread.run_sync(work, *arguments, limiter=self._limiter)
        finally:
            self._inside -= 1

    async def each(self, blocks: Iterator[bytes]) -> AsyncIterator[bytes]:
        """The blocks of a file, each read on a thread of this lane."""
        while (block := await to_thread.run_sync(next, blocks, None, limiter=self._limiter)) is not None:
            yield block


@dataclass
class Lanes:
    """The lanes of a service.

    The database takes one writer at a time, so that a few threads serve all
    workers.
    """

    jobs: Lane = field(default_factory=lambda: Lane("jobs", threads=4))
    replays: Lane = field(default_factory=lambda: Lane("replays", threads=4, queue=12))
    downloads: Lane = field(default_factory=lambda: Lane("downloads", threads=4))
    workers: Lane = field(default_factory=lambda: Lane("workers", threads=4))
    metrics: Lane = field(default_factory=lambda: Lane("scrapes", threads=1, queue=4))
    accounts: Lane = field(default_factory=lambda: Lane("accounts", threads=2))
    # Each takes 64 MiB and a core for some 50 ms.
    passwords: Lane = field(default_factory=lambda: Lane("sign-ins", threads=2, queue=16))
    sweeper: Lane = field(default_factory=lambda: Lane("sweeps", threads=1))
    imports: Lane = field(default_factory=lambda: Lane("imports", threads=2))
    # Of arenas that are being drawn: 10 ms to a second of a core each.
    reviews: Lane = field(default_factory=lambda: Lane("arenas to look over", threads=1, queue=8))
    compaction: Lane = field(default_factory=lambda: Lane("curves to compact", threads=1))
    # Of alerts: names are looked up and mail is sent there, each of which may take its time.
    alerts: Lane = field(default_factory=lambda: Lane("alerts", threads=4))

    def all(self) -> tuple[Lane, ...]:
        """Every lane, for whoever counts."""
        return (
            self.jobs,
            self.replays,
            self.downloads,
            self.workers,
            self.metrics,
            self.accounts,
            self.passwords,
            self.sweeper,
            self.imports,
            self.reviews,
            self.compaction,
            self.alerts,
        )
