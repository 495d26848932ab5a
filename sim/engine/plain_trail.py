"""The trail of one robot in plain Python: the reference of `sim.kernels.trail`."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.config import LidarConfig, TrailPart
from sim.kernels.room import LONG_TRAIL_ROOM, SHORT_TRAIL_ROOM
from sim.kernels.trail import SEEN_BEHIND, TRAIL_SPACING
from sim.lidar import ray_angles


class PlainTrail:
    """The crumbs of one attempt.

    Args:
        lidar: of the robot; its first scanner tells what is in sight.
    """

    def __init__(self, lidar: LidarConfig) -> None:
        self._angles = ray_angles(lidar) + lidar.mount.places[0][2]
        self._range = lidar.range
        # Half the angle between two rays: beyond it on either side of the field of view no ray tells anything.
        self._reach = float(self._angles[1] - self._angles[0]) / 2.0
        self._crumbs: list[tuple[float, float]] = []

    def drop(self, place: Sequence[float]) -> None:
        """Drop a crumb at x, y, metres, unless the last one lies near."""
        if not self._crumbs or math.dist(self._crumbs[-1], place) >= TRAIL_SPACING:
            self._crumbs.append((place[0], place[1]))

    def seen(self, ranges: NDArray[np.float64], pose: Sequence[float], part: TrailPart) -> NDArray[np.float64]:
        """What a robot at a pose sees of its trail, given its scan, metres: a part's numbers.

        They are (3 * sectors + 1,), and with a long memory (4 * sectors + 1,).
        """
        sectors, is_long = part.sectors, part.memory == "long"
        nearness, count, freshness, first = np.zeros((4, sectors))
        for age, (x, y) in enumerate(self._crumbs[: -(LONG_TRAIL_ROOM if is_long else SHORT_TRAIL_ROOM) - 1 : -1]):
            distance = math.dist((x, y), pose[:2])
            angle = _wrapped(math.atan2(y - pose[1], x - pose[0]) - pose[2])
            if not SEEN_BEHIND <= distance < self._range or self._meets(ranges, angle) < distance - SEEN_BEHIND:
                continue
            k = min(int((angle + math.pi) / math.tau * sectors), sectors - 1)
            nearness[k] = max(nearness[k], 1.0 - distance / self._range)
            count[k] += 1.0
            fresh = 1.0 - math.log(1.0 + age) / math.log(1.0 + LONG_TRAIL_ROOM) if is_long else 10.0 / (10.0 + age)
            freshness[k], first[k] = max(freshness[k], fresh), fresh
        dropped = len(self._crumbs)
        ages = [freshness, first] if is_long else [freshness]
        length = dropped / (dropped + (160.0 if is_long else 40.0))
        return np.concatenate([nearness, count / (count + 5.0), *ages, [length]])

    def _meets(self, ranges: NDArray[np.float64], angle: float) -> float:
        """What the ray nearest to an angle against the heading reads, metres; infinite where none points there."""
        off = np.abs([_wrapped(angle - ray) for ray in self._angles])
        ray = int(off.argmin())
        return float(ranges[ray]) if off[ray] <= self._reach else math.inf


def _wrapped(angle: float) -> float:
    return math.atan2(math.sin(angle), math.cos(angle))
