"""Openings that a robot is led to and comes no nearer to: they count farther with time, until others are nearer.

A gap may look wide enough from afar and not be; whoever turns back before it is led to it again for as long as it counts as
the nearest. Planners that explore put such frontiers on a list of those that they leave alone; here they only fall behind.
"""

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.room import OPENING_ROOM
from sim.kernels.sensing import FAST

DUE = 0.04
"""Metres by which the opening that is told first counts farther, each step, while the robot comes no nearer to it."""

NEARER = 0.2
"""Metres by which its way has to be shorter than it ever was for the robot to have come nearer."""

PATIENCE = 16
"""Steps after which is chosen anew what is told, where no view was kept meanwhile."""

TARGET_SLOT = OPENING_ROOM
"""In place of an opening's slot: the target, where a view shows it."""

_DUE = np.float32(DUE)
_NEARER = np.float32(NEARER)
_FAR = np.float32(1e9)


@kernel(fastmath=FAST)
def forgive(i, slot, robots):
    """Let an opening, or the target, count as far as it is."""
    robots.opening_dues[i, slot] = np.float32(0.0)
    robots.opening_nearest[i, slot] = _FAR


@kernel(fastmath=FAST)
def lose_patience(i, robots):
    """Let what was told first count farther, for the steps since it was chosen, unless the robot came nearer to it."""
    slot = robots.followed[i, 0]
    if slot >= 0:
        way = robots.leads[i, 0, 2]
        if way < robots.opening_nearest[i, slot] - _NEARER:
            robots.opening_nearest[i, slot] = way
        else:
            robots.opening_dues[i, slot] += _DUE * np.float32(robots.followed[i, 1])
    robots.followed[i, 1] = 0
