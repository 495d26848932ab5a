"""How long a robot has stayed about where it is: what tells one that turns about on one spot that it does.

A policy that acts on what it sees now does the same whenever it sees the same, and where that is to turn to one side and
then to the other it does so for good. What has changed meanwhile is the time.
"""

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.records import DWELL_PART
from sim.kernels.room import AWAY, LONG_STAY
from sim.kernels.sensing import FAST

STAY_NUMBERS = 3
"""What is kept of a stay: x, y of where it began, and its steps; -1 before the first."""

ZERO = np.float32(0.0)
ONE = np.float32(1.0)
_AWAY_SQUARED = np.float32(AWAY * AWAY)
_LONG = np.float32(LONG_STAY)


@kernel(fastmath=FAST)
def see_dwell(i, x, y, robots, p):
    """Write for how long robot i has stayed about where it believes to be, x, y, metres."""
    stay = robots.stays[i]
    dx = x - stay[0]
    dy = y - stay[1]
    if stay[2] < ZERO or dx * dx + dy * dy >= _AWAY_SQUARED:
        stay[0] = x
        stay[1] = y
        stay[2] = ZERO
    else:
        stay[2] += ONE
    seconds = stay[2] * np.float32(p.period)
    robots.observations[i, p.part_places[DWELL_PART]] = seconds / (seconds + _LONG)
