"""A generator of its own for every robot and mover, so that a robot's fate does not depend on how many drive beside it.

SplitMix64 (Steele, Lea and Flood 2014): 64 bits of state, passes BigCrush, and any two seeds give unrelated streams.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sim.kernels.options import kernel

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_TO_UNIT = 2.0**-53


@kernel()
def mixed(z):
    """SplitMix64's finaliser: a bijection of 64-bit integers whose output looks random."""
    z = (z ^ (z >> np.uint64(30))) * _FIRST
    z = (z ^ (z >> np.uint64(27))) * _SECOND
    return z ^ (z >> np.uint64(31))


@kernel()
def uniform(records, i):
    """The next number of the generator of robot or mover i, float64 in [0, 1)."""
    records[i].random += GOLDEN
    return np.float64(mixed(records[i].random) >> np.uint64(11)) * _TO_UNIT


@kernel()
def normal(records, i):
    """A number of the standard normal distribution (Box and Muller 1958), from two of generator i."""
    size = math.sqrt(-2.0 * math.log(1.0 - uniform(records, i)))  # 1 - u keeps the logarithm finite
    return size * math.cos(2.0 * math.pi * uniform(records, i))


def seed_streams(seed: int | None, count: int, *, key: tuple[int, ...]) -> NDArray[np.uint64]:
    """Generator states for robots (or movers) 0 to count - 1; number i's depends on the seed, the key and i alone.

    Args:
        seed: any non-negative integer, or None for one from the operating system.
        count: how many.
        key: of the stream, see `sim.streams`.
    """
    root = np.random.SeedSequence(seed, spawn_key=key).generate_state(1, np.uint64)[0]
    z = root + (np.arange(1, count + 1, dtype=np.uint64) << np.uint64(32))
    # The same mixing as above, on the whole array.
    z = (z ^ (z >> np.uint64(30))) * _FIRST
    z = (z ^ (z >> np.uint64(27))) * _SECOND
    states: NDArray[np.uint64] = z ^ (z >> np.uint64(31))
    return states
