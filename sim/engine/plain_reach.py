"""How far a robot could go straight on in each direction, in NumPy: the reference of `sim.kernels.reach`."""

import numpy as np
from numpy.typing import NDArray

from sim.config import ReachPart, TaskConfig
from sim.engine.plain_way import reading_ends
from sim.kernels.room import REACH_DIRECTIONS
from sim.observations import near_distance, reach_directions


def seen_reach(
    ranges: NDArray[np.float64], bearing: float, distance: float, part: ReachPart, task: TaskConfig
) -> NDArray[np.float64]:
    """What a robot sees of how far it could go, (sectors,) from right to left, beginning behind it, and of its progress.

    Args:
        ranges: (scan,) metres.
        bearing: of the target, radians against the heading.
        distance: likewise, metres.
        part: says how many sectors, and whether progress is told.
        task: whose LiDAR, body and observation count.

    Returns:
        (sectors,), or (2 * sectors,) with progress.
    """
    near = near_distance(task)
    x, y = reading_ends(ranges, task)[ranges < task.lidar.range].T
    directions = reach_directions(task)[:, None]
    along, across = x * np.cos(directions) + y * np.sin(directions), y * np.cos(directions) - x * np.sin(directions)
    until = along - np.sqrt(np.maximum(near**2 - across**2, 0.0))
    meets = (np.abs(across) < near) & (along > 0.0)
    reach = np.where(meets, np.maximum(until, 0.0), task.lidar.range).min(axis=1, initial=task.lidar.range)
    farthest = reach.reshape(part.sectors, REACH_DIRECTIONS).max(axis=1)
    seen = [near / (near + farthest)]
    if part.progress:
        ends = reach * np.exp(1j * directions[:, 0])
        progress = distance - np.abs(distance * np.exp(1j * bearing) - ends)
        seen.append(progress.reshape(part.sectors, REACH_DIRECTIONS).max(axis=1) / task.lidar.range)
    return np.concatenate(seen)
