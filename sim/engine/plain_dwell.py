"""How long one robot has stayed about where it is, in plain Python: the reference of `sim.kernels.dwell`."""

import math
from collections.abc import Sequence

from sim.kernels.room import AWAY, LONG_STAY


class PlainDwell:
    """The stay of one attempt.

    Args:
        place: x, y of where it begins, metres.
        period: between two steps, seconds.
    """

    def __init__(self, place: Sequence[float], period: float) -> None:
        self._period = period
        self._begin, self._since = (place[0], place[1]), 0

    def seen(self, place: Sequence[float], step: int) -> float:
        """What the robot sees of it at x, y after so many steps: the part's number."""
        if math.dist(self._begin, place) >= AWAY:
            self._begin, self._since = (place[0], place[1]), step
        seconds = (step - self._since) * self._period
        return seconds / (seconds + LONG_STAY)
