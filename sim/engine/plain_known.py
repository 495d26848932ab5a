"""Since when one robot knows what it sees, in plain Python: the reference of `sim.kernels.known`."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.config import KnownPart, LidarConfig
from sim.kernels.known import FULL_RANGE, SECTOR_EDGE, VIEW_DIRECTIONS, VIEW_SPACING
from sim.kernels.room import SHORT_OF, VIEW_ROOM
from sim.kernels.trail import SEEN_BEHIND
from sim.lidar import ray_angles


class PlainViews:
    """The views of one attempt.

    Args:
        lidar: of the robot; its first scanner's scan is what a view keeps.
    """

    def __init__(self, lidar: LidarConfig) -> None:
        self._angles = ray_angles(lidar) + lidar.mount.places[0][2]
        self._range = lidar.range
        # Half the angle between two rays: beyond it on either side of the field of view no ray tells anything.
        self._reach = float(self._angles[1] - self._angles[0]) / 2.0
        self._views: list[tuple[tuple[float, float], NDArray[np.float64]]] = []

    def keep(self, ranges: NDArray[np.float64], pose: Sequence[float]) -> None:
        """Keep the view from a pose, unless the last one was kept near it."""
        place = (pose[0], pose[1])
        if self._views and math.dist(self._views[-1][0], place) < VIEW_SPACING:
            return
        directions = ((np.arange(VIEW_DIRECTIONS) + 0.5) / VIEW_DIRECTIONS * 2.0 - 1.0) * math.pi
        off = np.abs(_wrapped(directions[:, None] - pose[2] - self._angles))
        rays = off.argmin(axis=1)
        told = off[np.arange(len(off)), rays] <= self._reach
        readings = np.where(told, ranges[: len(self._angles)][rays], 0.0)
        self._views.append((place, np.floor(readings / self._range * FULL_RANGE + 0.5) * self._range / FULL_RANGE))

    def seen(
        self, ranges: NDArray[np.float64], pose: Sequence[float], target: Sequence[float], part: KnownPart
    ) -> NDArray[np.float64]:
        """Since when a robot at a pose knows what it sees, given its scan, metres: a part's numbers.

        Returns:
            (2 * sectors,), or (3 * sectors,) with progress.
        """
        age, nearness, progress = np.zeros((3, part.sectors))
        angles = _wrapped(self._angles)
        sectors = np.minimum((angles + math.pi) / math.tau * part.sectors + SECTOR_EDGE, part.sectors - 1).astype(int)
        views = self._views[-VIEW_ROOM:]
        for sector in range(part.sectors):
            rays = np.flatnonzero(sectors == sector)
            if not len(rays):
                continue
            ray = rays[ranges[rays].argmax()]
            ahead = max(ranges[ray] - SHORT_OF, 0.5 * ranges[ray])
            x, y = (pose[k] + ahead * turn(angles[ray] + pose[2]) for k, turn in enumerate((math.cos, math.sin)))
            distances = np.array([math.dist(place, (x, y)) for place, _ in views])
            shown = [number for number, view in enumerate(views) if self._shows(view, x, y)]
            followed = len(views) - 1 - shown[0] if shown else 0
            age[sector] = 1.0 - math.log(1.0 + followed) / math.log(1.0 + VIEW_ROOM)
            nearness[sector] = max(1.0 - distances.min(initial=math.inf) / self._range, 0.0)
            progress[sector] = (math.dist(pose[:2], target) - math.dist((x, y), target)) / self._range
        return np.concatenate([age, nearness, *[progress][: part.progress]])

    def _shows(self, view: tuple[tuple[float, float], NDArray[np.float64]], x: float, y: float) -> bool:
        """Whether a place was in sight in a view."""
        (there_x, there_y), readings = view
        distance = math.dist((there_x, there_y), (x, y))
        direction = math.atan2(y - there_y, x - there_x)
        k = min(int((direction + math.pi) / math.tau * VIEW_DIRECTIONS), VIEW_DIRECTIONS - 1)
        return distance < self._range and bool(distance < readings[k] + SEEN_BEHIND)


def _wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray((angles + math.pi) % math.tau - math.pi)
