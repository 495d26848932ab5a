"""A generator of its own for every robot, so that a robot's fate does not depend on how many drive beside it.

SplitMix64 (Steele, Lea and Flood 2014): 64 bits of state, passes BigCrush, and any two seeds give unrelated streams.
"""

import numba as nb
import numpy as np
from numpy.typing import NDArray

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_TO_UNIT = 2.0**-53


@nb.njit(cache=True, nogil=True)
def mixed(z):
    """SplitMix64's finaliser: a bijection of 64-bit integers whose output looks random."""
    z = (z ^ (z >> np.uint64(30))) * _FIRST
    z = (z ^ (z >> np.uint64(27))) * _SECOND
    return z ^ (z >> np.uint64(31))


@nb.njit(cache=True, nogil=True)
def uniform(robots, i):
    """The next number of robot i's generator, float64 in [0, 1)."""
    robots[i].random += GOLDEN
    return np.float64(mixed(robots[i].random) >> np.uint64(11)) * _TO_UNIT


def seed_streams(seed: int | None, count: int) -> NDArray[np.uint64]:
    """Generator states for robots 0 to count - 1; robot i's depends on the seed and i alone.

    Args:
        seed: any non-negative integer, or None for one from the operating system.
        count: how many robots.
    """
    root = np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]
    z = root + (np.arange(1, count + 1, dtype=np.uint64) << np.uint64(32))
    # The same mixing as above, on the whole array.
    z = (z ^ (z >> np.uint64(30))) * _FIRST
    z = (z ^ (z >> np.uint64(27))) * _SECOND
    states: NDArray[np.uint64] = z ^ (z >> np.uint64(31))
    return states
