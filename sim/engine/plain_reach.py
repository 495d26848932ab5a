"""How far a robot could go straight on in each direction, in NumPy: the reference of `sim.kernels.reach`."""

import numpy as np
from numpy.typing import NDArray

from sim.config import ReachPart, TaskConfig
from sim.engine.plain_way import reading_ends
from sim.kernels.reach import DIRECTIONS
from sim.observations import near_distance


def seen_reach(ranges: NDArray[np.float64], part: ReachPart, task: TaskConfig) -> NDArray[np.float64]:
    """What a robot sees of how far it could go, (sectors,) from right to left, beginning behind it.

    Args:
        ranges: (scan,) metres.
        part: says how many sectors.
        task: whose LiDAR and body count.
    """
    near, count = near_distance(task), part.sectors * DIRECTIONS
    x, y = reading_ends(ranges, task)[ranges < task.lidar.range].T
    directions = ((np.arange(count) + 0.5) / count * 2.0 - 1.0)[:, None] * np.pi
    along, across = x * np.cos(directions) + y * np.sin(directions), y * np.cos(directions) - x * np.sin(directions)
    until = along - np.sqrt(np.maximum(near**2 - across**2, 0.0))
    meets = (np.abs(across) < near) & (along > 0.0)
    reach = np.where(meets, np.maximum(until, 0.0), task.lidar.range).min(axis=1, initial=task.lidar.range)
    farthest = reach.reshape(part.sectors, DIRECTIONS).max(axis=1)
    return np.asarray(near / (near + farthest))
