"""What a part of an observation is made of: what robots know at one moment, NumPy only.

>>> import numpy as np
>>> def nearest(part: ObservationPart, task: TaskConfig) -> See:
...     limit = np.float32(task.lidar.range)
...     return lambda sight: sight.ranges.min(axis=1, keepdims=True) / limit

A part has no memory of its own: what it was at earlier moments is its setting `frames`.
"""

from collections.abc import Callable
from dataclasses import dataclass

from sim.arrays import Floats
from sim.config import TaskConfig
from sim.extending.parts import ObservationNumber, ObservationPart
from sim.lidar import ray_angles

__all__ = ["Floats", "ObservationNumber", "ObservationPart", "See", "Sight", "TaskConfig", "ray_angles"]


@dataclass(frozen=True)
class Sight:
    """What n robots know; float32 arrays that must not be changed. n differs from call to call.

    It is what a robot in a building knows too: disturbed scans, and poses as odometry believes them.

    Attributes:
        ranges: (n, scan) metres, of each LiDAR from right to left (`ray_angles`), one after the other.
        poses: (n, 3) x, y in metres and heading in [-pi, pi].
        targets: (n, 2) x, y in metres.
        speeds: (n, A) in the last step, as fractions of the limits (`sim.actions`).
        actions: (n, A) last commanded, likewise, whether followed by then or not.
    """

    ranges: Floats
    poses: Floats
    targets: Floats
    speeds: Floats
    actions: Floats

    def __len__(self) -> int:
        return len(self.poses)


See = Callable[[Sight], Floats]
"""A sight of n robots to a part's numbers (n, numbers)."""
