"""Until when each attempt keeps its run: by a clock that nobody can set.

The server is the only process that hears the workers, so it alone keeps the time, in its memory and on the monotonic clock:
the wall clock may be set back an hour, and a lease that hung on it would keep a dead worker's run for as long. A lease is
renewed when a message arrives, not when it is stored: a database that takes its time costs nobody a run. A server that
starts grants every attempt that the database knows a lease anew, for nobody could have heard its worker before.
"""

import threading
import time
from collections.abc import Callable, Iterable

Attempt = tuple[str, int]
"""A run's id and the number of its attempt."""


class Leases:
    """The time left to each attempt. Thread-safe.

    Args:
        seconds: of a lease.
        clock: seconds that only grow.
    """

    def __init__(self, seconds: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._seconds = seconds
        self._clock = clock
        self._lock = threading.Lock()
        self._until: dict[Attempt, float] = {}

    def renew(self, run_id: str, attempt: int) -> None:
        """Its worker was heard just now."""
        with self._lock:
            self._until[run_id, attempt] = self._clock() + self._seconds

    def renew_all(self) -> None:
        """Nobody could have been heard for a while: everybody has a whole lease again."""
        with self._lock:
            until = self._clock() + self._seconds
            self._until = dict.fromkeys(self._until, until)

    def expired(self, active: Iterable[Attempt]) -> set[Attempt]:
        """Those whose time is up among all attempts that are under way (`active`); any other is forgotten."""
        with self._lock:
            now = self._clock()
            self._until = {attempt: self._until.get(attempt, now + self._seconds) for attempt in active}
            return {attempt for attempt, until in self._until.items() if until < now}

    def is_expired(self, run_id: str, attempt: int) -> bool:
        """Whether this attempt's time is up."""
        with self._lock:
            return self._until.get((run_id, attempt), float("inf")) < self._clock()
