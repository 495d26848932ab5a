"""The arrays that the kernels work on, in two bundles that Numba takes as arguments."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Integers = NDArray[np.int32]


class Geometry(NamedTuple):
    """All arenas of a pool, padded to the same number of shapes; metres, in each arena's own frame.

    Attributes:
        bounds: (M, 2) half width, half height.
        circles: (M, C, 3), see `CIRCLE_COLUMNS`.
        boxes: (M, B, 6), see `BOX_COLUMNS`.
        starts, targets: (cells, 2) lower left corners of the free cells of all arenas, one after another.
        start_offsets, target_offsets: (M + 1,) where each arena's cells begin.
        origins: (tiles, 2) float64, centre of each tile in the Space.
        ray_cos, ray_sin: (rays,) directions of the rays against the heading.
    """

    bounds: Floats
    circles: Floats
    boxes: Floats
    starts: Floats
    targets: Floats
    start_offsets: Integers
    target_offsets: Integers
    origins: Doubles
    ray_cos: Floats
    ray_sin: Floats


class Robots(NamedTuple):
    """All robots; row i of every array is robot i.

    Attributes:
        records: (N,) of `sim.kernels.records.ROBOT`.
        poses: (N, 3) x, y, heading in the arena's frame; heading in [-pi, pi].
        targets: (N, 2).
        ranges: (N, rays) metres.
        observations: (N, numbers), after the step and after a reset that it caused.
        final_observations: (N, numbers), the last ones of the episodes that ended in this step.
        rewards: (N,) of this step.
        terms: (N, 4) the reward's terms, in the order of `REWARD_TERMS`.
        terminations, truncations: (N,) bool.
        outcomes: (N,) how the attempt that ended in this step ended; 0 where none did.
    """

    records: NDArray[np.void]
    poses: Floats
    targets: Floats
    ranges: Floats
    observations: Floats
    final_observations: Floats
    rewards: Floats
    terms: Floats
    terminations: NDArray[np.bool_]
    truncations: NDArray[np.bool_]
    outcomes: NDArray[np.uint8]


REWARD_TERMS = ("arrival", "collision", "progress", "penalty")
"""Columns of `Robots.terms`; their sum is the reward."""
