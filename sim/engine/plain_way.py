"""The straight way to the target in NumPy: the reference of `sim.kernels.way`."""

import math

import numpy as np
from numpy.typing import NDArray

from sim.config import TaskConfig
from sim.lidar import drawn_ray_angles, ray_origins
from sim.observations import near_distance


def reading_ends(ranges: NDArray[np.float64], task: TaskConfig) -> NDArray[np.float64]:
    """Where readings (scan,) end, (scan, 2) metres in the robot's frame."""
    angles = drawn_ray_angles(task.lidar, task.lidar.field_of_view)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.asarray(ray_origins(task.lidar, [(0.0, 0.0, 0.0)])[0] + ranges[:, None] * directions)


def seen_way(ranges: NDArray[np.float64], bearing: float, distance: float, task: TaskConfig) -> NDArray[np.float64]:
    """How much of the straight way to the target is seen to be free, and whether all of it is, (2,).

    Args:
        ranges: (scan,) metres.
        bearing: of the target, radians against the heading.
        distance: likewise, metres.
        task: whose LiDAR, body and arrival distance count.
    """
    ends = reading_ends(ranges, task)
    along, across = ends @ [math.cos(bearing), math.sin(bearing)], ends @ [-math.sin(bearing), math.cos(bearing)]
    meets = (ranges < task.lidar.range) & (along >= 0.0) & (np.abs(across) < near_distance(task))
    length = max(distance - task.arrival_distance, 0.0)
    free = min(length, task.lidar.range, along[meets].min(initial=math.inf))
    return np.array([free / length if length > 0.0 else 1.0, float(free >= length)])
