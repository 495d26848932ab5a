"""How the observation part is computed: NumPy only, for many robots at once."""

import numpy as np

from my_lab import OpeningPart
from sim.extending.observing import See, Sight, TaskConfig, ray_angles


def opening(part: OpeningPart, task: TaskConfig) -> See:
    """Made once for a task; what it returns is called with what n robots know, and gives (n, 2)."""
    angles = ray_angles(task.lidar)
    rays = min(part.rays, len(angles))
    places = len(angles) - rays + 1
    bearings = (angles[:places] + angles[rays - 1 :]) / 2.0

    def see(sight: Sight):
        scans = sight.ranges[:, : len(angles)]  # of the first LiDAR
        room = np.minimum.reduce([scans[:, ray : ray + places] for ray in range(rays)])
        freest = room.argmax(axis=1)
        return np.stack([bearings[freest] / np.pi, room.max(axis=1) / task.lidar.range], axis=1)

    return see
