"""Where a robot has been on its way to a goal: crumbs that it drops, and which of them are in sight.

As in training a crumb is dropped wherever the last one is 0.24 m away, the newest 256 are remembered, of a long trail
1,024, and one is in sight where the ray that points nearest to it reads at most 0.1 m less than its distance, or where no
ray points. For each sector of the full turn around the robot, from right to left beginning behind it, the trail tells of
the crumbs in sight

| numbers   | what they are                                                             |
|-----------|---------------------------------------------------------------------------|
| nearness  | 1 - distance of the nearest / range of the LiDAR; 0 without any           |
| crumbs    | n / (n + 5), n how many they are                                          |
| freshness | of the newest, 10 / (10 + m), m crumbs dropped since then; 0 without any  |

sector by sector each, and last n / (n + 40), n all crumbs that were dropped. Of a long trail freshness is
1 - ln(1 + m) / ln(1025), behind it stands that of each sector's oldest crumb, and last n / (n + 160).
"""

from collections import deque

import numpy as np
from numpy.typing import ArrayLike

from .observation import Reals, ray_angles, wrap
from .policy import Specification

SPACING = 0.24
SHORT_ROOM, LONG_ROOM = 256, 1024
BEHIND = 0.1


class Trail:
    """The crumbs of one robot on its way to one goal.

    Args:
        specification: of a policy that sees its trail.

    Attributes:
        kind: of the part that it makes the numbers of.
    """

    def __init__(self, specification: Specification) -> None:
        (part,) = (part for part in specification.parts if part.remembered_by == "trail")
        self.kind, self._is_long = part.kind, part.kind == "long_trail"
        self._sectors = (part.size - 1) // (4 if self._is_long else 3)
        self._range = specification.range
        self._angles = ray_angles(specification) + specification.mounts[0][2]
        self._reach = (self._angles[1] - self._angles[0]) / 2.0
        self._crumbs: deque[tuple[float, float]] = deque(maxlen=LONG_ROOM if self._is_long else SHORT_ROOM)
        self._dropped = 0

    def clear(self) -> None:
        """Forget it: a new way begins."""
        self._crumbs.clear()
        self._dropped = 0

    def see(self, ranges: ArrayLike, pose: ArrayLike) -> Reals:
        """Drop a crumb where it is time to, and tell what is in sight; once per control period.

        Args:
            ranges: (scan,) metres, as the policy sees them.
            pose: x, y in metres and heading in radians.

        Returns:
            (3 * sectors + 1,), of a long trail (4 * sectors + 1,).
        """
        scan = np.asarray(ranges, np.float64)[: len(self._angles)]
        x, y, heading = np.asarray(pose, np.float64)
        if not self._crumbs or np.hypot(self._crumbs[-1][0] - x, self._crumbs[-1][1] - y) >= SPACING:
            self._crumbs.append((x, y))
            self._dropped += 1
        dx, dy = (np.array(self._crumbs) - (x, y)).T
        distances, angles = np.hypot(dx, dy), wrap(np.arctan2(dy, dx) - heading)
        off = np.abs(wrap(angles[:, None] - self._angles))
        rays = off.argmin(axis=1)
        met = np.where(off[np.arange(len(off)), rays] <= self._reach + 1e-9, scan[rays], np.inf)
        in_sight = (distances >= BEHIND) & (distances < self._range) & (met >= distances - BEHIND)
        sectors = np.minimum((angles + np.pi) / (2.0 * np.pi) * self._sectors, self._sectors - 1).astype(int)[in_sight]
        ages = np.arange(len(distances))[::-1][in_sight]
        nearness, count, newest, oldest = np.zeros((4, self._sectors))
        np.maximum.at(nearness, sectors, 1.0 - distances[in_sight] / self._range)
        np.add.at(count, sectors, 1.0)
        freshness = 1.0 - np.log1p(ages) / np.log1p(LONG_ROOM) if self._is_long else 10.0 / (10.0 + ages)
        # They stand from the oldest to the newest, and the last one that is written to a place stays there.
        newest[sectors], oldest[sectors[::-1]] = freshness, freshness[::-1]
        length = self._dropped / (self._dropped + (160.0 if self._is_long else 40.0))
        return np.concatenate((nearness, count / (count + 5.0), newest, *([oldest] if self._is_long else []), (length,)))
