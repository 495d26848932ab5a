"""The views that one robot keeps on its way, in plain Python: the reference of `sim.kernels.views`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.config import LidarConfig
from sim.kernels.views import FULL_RANGE, VIEW_DIRECTIONS, VIEW_SPACING
from sim.lidar import ray_angles

Place = tuple[float, float]


@dataclass(frozen=True, eq=False)
class PlainView:
    """What a robot saw from a place.

    Attributes:
        place: metres.
        readings: (VIEW_DIRECTIONS,) metres, 0 where no ray pointed.
    """

    place: Place
    readings: NDArray[np.float64]


class PlainViews:
    """The views of one attempt.

    Args:
        lidar: of the robot; its first scanner's scan is what a view keeps.

    Attributes:
        kept: all of them, the oldest first.
    """

    def __init__(self, lidar: LidarConfig) -> None:
        self.kept: list[PlainView] = []
        self._angles = ray_angles(lidar) + lidar.mount.places[0][2]
        self._range = lidar.range
        # Half the angle between two rays: beyond it on either side of the field of view no ray tells anything.
        self._reach = float(self._angles[1] - self._angles[0]) / 2.0

    def keep(self, ranges: NDArray[np.float64], pose: Sequence[float]) -> bool:
        """Keep the view from a pose, unless the last one was kept near it; returns whether it did."""
        place = (pose[0], pose[1])
        if self.kept and math.dist(self.kept[-1].place, place) < VIEW_SPACING:
            return False
        off = np.abs(wrapped(angle_of(np.arange(VIEW_DIRECTIONS))[:, None] - pose[2] - self._angles))
        rays = off.argmin(axis=1)
        told = off[np.arange(len(off)), rays] <= self._reach + 1e-9
        readings = np.where(told, ranges[: len(self._angles)][rays], 0.0)
        self.kept.append(PlainView(place, np.floor(readings / self._range * FULL_RANGE + 0.5) * self._range / FULL_RANGE))
        return True


def angle_of(direction: ArrayLike) -> NDArray[np.float64]:
    """Where a direction of a view points, radians."""
    return np.asarray(((np.asarray(direction) + 0.5) / VIEW_DIRECTIONS * 2.0 - 1.0) * math.pi)


def end_of(view: PlainView, direction: float, distance: float) -> Place:
    """The place in a direction of a view, so many metres away."""
    angle = float(angle_of(direction))
    return view.place[0] + distance * math.cos(angle), view.place[1] + distance * math.sin(angle)


def wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles in [-pi, pi), radians."""
    return np.asarray((angles + math.pi) % math.tau - math.pi)
