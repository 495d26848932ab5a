"""Since when a robot knows what it sees: views that it keeps on its way to a goal, and which of them showed it before.

As in training a view is kept wherever the last one is 0.48 m away, the newest 256 are remembered, each with what the first
LiDAR read in 120 directions, in 255ths of its range. For each sector of the full turn around the robot, from right to left
beginning behind it, the end of its farthest sight, 0.2 m before what that ray meets (half way there where that is nearer),
is asked for in them:

| numbers   | what they are                                                                                     |
|-----------|---------------------------------------------------------------------------------------------------|
| freshness | of the oldest view that showed it, 1 - ln(1 + m) / ln(257), m views kept since; 1 where none did    |
| nearness  | 1 - distance of the nearest view / range of the LiDAR, at least 0                                  |
| progress  | how much nearer to the target that end is than the robot / range; in `known_progress` only         |

sector by sector each, 0 in sectors without a ray. A view showed a place where what it read towards it is at most 0.1 m less
than how far that is.
"""

from collections import deque

import numpy as np
from numpy.typing import ArrayLike

from .observation import Reals, ray_angles, wrap
from .policy import Specification

SPACING = 0.48
ROOM = 256
DIRECTIONS = 120
SHORT_OF = 0.2
BEHIND = 0.1
FULL_RANGE = 255
SECTOR_EDGE = 1e-3


class KeptViews:
    """The views that a robot keeps on its way to one goal.

    Args:
        specification: of a policy that remembers views.

    Attributes:
        places: (x, y) of each in metres, the oldest first.
        readings: what was read there, (DIRECTIONS,) metres each.
        kept: how many were, those that are forgotten counted.
    """

    def __init__(self, specification: Specification) -> None:
        self.places: deque[tuple[float, float]] = deque(maxlen=ROOM)
        self.readings: deque[Reals] = deque(maxlen=ROOM)
        self.kept = 0
        self._range = specification.range
        self._angles = wrap(ray_angles(specification) + specification.mounts[0][2])
        self._half_ray = (ray_angles(specification)[1] - ray_angles(specification)[0]) / 2.0

    def clear(self) -> None:
        """Forget them: a new way begins."""
        self.places.clear()
        self.readings.clear()
        self.kept = 0

    def keep(self, scan: Reals, pose: Reals) -> bool:
        """Keep a view of the first LiDAR's scan, metres, where it is time to; returns whether it was."""
        x, y, heading = pose
        if self.places and np.hypot(self.places[-1][0] - x, self.places[-1][1] - y) < SPACING:
            return False
        directions = ((np.arange(DIRECTIONS) + 0.5) / DIRECTIONS - 0.5) * 2.0 * np.pi
        off = np.abs(wrap(directions[:, None] - heading - self._angles))
        rays = off.argmin(axis=1)
        told: Reals = np.where(off[np.arange(DIRECTIONS), rays] <= self._half_ray + 1e-9, scan[rays], 0.0)
        self.places.append((x, y))
        self.readings.append(np.floor(told / self._range * FULL_RANGE + 0.5) * self._range / FULL_RANGE)
        self.kept += 1
        return True


class Views(KeptViews):
    """Since when one robot knows what it sees on its way to one goal.

    Args:
        specification: of a policy that sees since when it knows what it sees.

    Attributes:
        kind: of the part that it makes the numbers of.
    """

    def __init__(self, specification: Specification) -> None:
        super().__init__(specification)
        (part,) = (part for part in specification.parts if part.remembered_by == "views")
        self.kind, kinds = part.kind, 3 if part.kind == "known_progress" else 2
        self._sectors, self._kinds = part.size // kinds, kinds
        self._of_rays = np.minimum(
            (self._angles + np.pi) / (2.0 * np.pi) * self._sectors + SECTOR_EDGE, self._sectors - 1
        ).astype(int)

    def see(self, ranges: ArrayLike, pose: ArrayLike, target: ArrayLike) -> Reals:
        """Keep a view where it is time to, and tell what it showed before; once per control period.

        Args:
            ranges: (scan,) metres, as the policy sees them.
            pose: x, y in metres and heading in radians.
            target: x, y in metres, in the same frame.

        Returns:
            (2 * sectors,), with progress (3 * sectors,).
        """
        scan = np.asarray(ranges, np.float64)[: len(self._angles)]
        x, y, heading = np.asarray(pose, np.float64)
        self.keep(scan, np.asarray(pose, np.float64))
        goal = np.asarray(target, np.float64)
        freshness, nearness, progress = np.zeros((3, self._sectors))
        for sector in np.unique(self._of_rays):
            rays = np.flatnonzero(self._of_rays == sector)
            ray = rays[scan[rays].argmax()]
            ahead = max(scan[ray] - SHORT_OF, 0.5 * scan[ray])
            towards = self._angles[ray] + heading
            end = np.array((x + ahead * np.cos(towards), y + ahead * np.sin(towards)))
            offsets = end - np.array(self.places)
            distances = np.hypot(*offsets.T)
            showed = np.flatnonzero(self._show(offsets, distances))
            followed = len(distances) - 1 - showed[0] if len(showed) else 0
            freshness[sector] = 1.0 - np.log1p(followed) / np.log1p(ROOM)
            nearness[sector] = max(1.0 - distances.min() / self._range, 0.0)
            progress[sector] = (np.hypot(*(goal - (x, y))) - np.hypot(*(goal - end))) / self._range
        return np.concatenate((freshness, nearness, progress)[: self._kinds])

    def _show(self, offsets: Reals, distances: Reals) -> Reals:
        """Which views show a place so far from each of them, (views, 2) and (views,)."""
        directions = np.arctan2(offsets[:, 1], offsets[:, 0])
        which = np.minimum((directions + np.pi) / (2.0 * np.pi) * DIRECTIONS, DIRECTIONS - 1).astype(int)
        sights = np.array(self.readings)[np.arange(len(distances)), which] + BEHIND
        shown: Reals = (distances < self._range) & (distances < sights)
        return shown
