"""When the sweeper last got round, so that others can tell whether it still does."""

import time
from collections.abc import Callable


class Pulse:
    """The age of the last beat.

    Args:
        clock: seconds that only grow.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._last: float | None = None

    def beat(self) -> None:
        """It got round just now."""
        self._last = self._clock()

    @property
    def age(self) -> float:
        """Seconds since the last beat; infinity before the first."""
        return float("inf") if self._last is None else self._clock() - self._last
