"""Makes the policy's observation from a scan, a pose and a target: the numbers that the simulator gave it in training.

| numbers     | 'improved'                                       | 'paper'                              |
|-------------|--------------------------------------------------|--------------------------------------|
| 0 ...       | near / max(nearest ray of the batch, near)       | nearest ray of the batch / range     |
| batches     | last linear velocity / its limit                 | the same                             |
| batches + 1 | last angular velocity / its limit                | the same                             |
| batches + 2 | d / (d + 1), d the distance to the target        | d / diagonal of the arena            |
| batches + 3 | bearing / pi (target against heading, left +)    | (direction mod 2 pi) / 2 pi          |
| batches + 4 | heading / pi                                     | (heading mod 2 pi) / 2 pi            |
| batches + 5 | |bearing| / pi                                   | the same                             |

Rays go from right to left. Poses and targets stand in one fixed frame (the odometry's), whose x axis is heading 0.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .policy import Floats, Specification

Reals = NDArray[np.float64]

_TURN = 2.0 * np.pi


def wrap(angles: ArrayLike) -> Reals:
    """Angles in [-pi, pi)."""
    wrapped: Reals = (np.asarray(angles, np.float64) + np.pi) % _TURN - np.pi
    return wrapped


def ray_angles(specification: Specification) -> Reals:
    """Angles of the policy's rays against the heading, (rays,) radians, from right to left.

    The first and the last stand on the edges of the field of view; in a full circle, where both edges are one direction, the
    last is left out.
    """
    half = specification.field_of_view / 2.0
    full = specification.field_of_view >= _TURN - 1e-9
    return np.linspace(-half, half, specification.rays, endpoint=not full)


def observe(
    specification: Specification, ranges: ArrayLike, poses: ArrayLike, targets: ArrayLike, last_actions: ArrayLike
) -> Floats:
    """What n robots see at one moment: the whole observation where no frames are stacked, else see `Frames`.

    Args:
        specification: the policy's.
        ranges: (n, rays) metres along `ray_angles`, at most the policy's range.
        poses: (n, 3) x, y in metres and heading in radians.
        targets: (n, 2) x, y in metres, in the same frame.
        last_actions: (n, 2) what was last commanded, as fractions of the speed limits.

    Returns:
        (n, batches + 6).
    """
    pose, target = np.asarray(poses, np.float64), np.asarray(targets, np.float64)
    scan = np.asarray(ranges, np.float64)
    nearest = scan.reshape(len(scan), specification.batches, -1).min(axis=2)
    offset = target - pose[:, :2]
    distance = np.hypot(offset[:, 0], offset[:, 1])
    direction = np.arctan2(offset[:, 1], offset[:, 0])
    heading = wrap(pose[:, 2])
    bearing = wrap(direction - heading)
    if specification.observation == "paper":
        seen = nearest / specification.range
        goal = (distance / specification.diagonal, direction % _TURN / _TURN, heading % _TURN / _TURN)
    else:
        seen = specification.near / np.maximum(nearest, specification.near)
        goal = (distance / (distance + 1.0), bearing / np.pi, heading / np.pi)
    columns = (seen, np.asarray(last_actions, np.float64), np.stack((*goal, np.abs(bearing) / np.pi), axis=1))
    return np.concatenate(columns, axis=1).astype(np.float32)


class Frames:
    """Stacks what was seen at the latest moments, the newest first; a way begins with its first frame repeated.

    Args:
        specification: the policy's.
    """

    def __init__(self, specification: Specification) -> None:
        self._frames = specification.frames
        self._seen: list[Floats] = []

    def push(self, frame: Floats) -> Floats:
        """The observation (n, frames * size) after the newest frame (n, size), one control period after the last."""
        self._seen = [frame, *(self._seen or [frame] * self._frames)][: self._frames]
        return np.concatenate(self._seen, axis=1)

    def clear(self) -> None:
        """Forget what was seen: a new way begins."""
        self._seen = []


@dataclass(frozen=True)
class Scan:
    """A sensor's scan as it comes, in the terms of ROS's `sensor_msgs/LaserScan`.

    Attributes:
        angle_min: of the first beam against the sensor's x axis, radians.
        angle_increment: between two beams, radians; negative for a sensor that turns to the right.
        range_min, range_max: what the sensor can measure, metres.
        ranges: (beams,) metres.
    """

    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: Reals

    def angles(self, sensor_yaw: float) -> Reals:
        """Angles of the beams against the heading, (beams,), wrapped, for a sensor mounted at this yaw."""
        return wrap(self.angle_min + self.angle_increment * np.arange(len(self.ranges)) + sensor_yaw)

    def distances(self) -> Reals:
        """Distances that can be relied on, (beams,): infinite where nothing was hit, nan where nothing is known.

        As REP 117 has it: -inf is an object too near to be measured, and becomes 0; +inf, and what is beyond `range_max`, is
        free; nan, and a finite number below `range_min` (many sensors write 0 for a beam that did not return), is unknown.
        """
        ranges = np.asarray(self.ranges, np.float64)
        distances = np.where(ranges > self.range_max, np.inf, ranges)
        distances = np.where(ranges < self.range_min, np.nan, distances)
        return np.where(np.isneginf(ranges), 0.0, distances)


def resample(scan: Scan, specification: Specification, sensor_yaw: float, max_gap: float) -> Reals:
    """The policy's rays (rays,), each the known beam nearest to it in angle, cut at the policy's range.

    Args:
        scan: the sensor's.
        specification: the policy's.
        sensor_yaw: of the sensor against the heading, radians.
        max_gap: largest angle between a ray and its beam, radians; a ray without a beam that near is nan.
    """
    angles, distances = scan.angles(sensor_yaw), scan.distances()
    known = ~np.isnan(distances)
    rays = ray_angles(specification)
    if not known.any():
        return np.full(len(rays), np.nan)
    order = np.argsort(angles[known], kind="stable")
    angles, distances = angles[known][order], distances[known][order]
    # One beam more on either side closes the circle.
    angles = np.concatenate(([angles[-1] - _TURN], angles, [angles[0] + _TURN]))
    distances = np.concatenate(([distances[-1]], distances, [distances[0]]))
    wrapped = wrap(rays)
    right = np.clip(np.searchsorted(angles, wrapped), 1, len(angles) - 1)
    left = right - 1
    nearest = np.where(wrapped - angles[left] <= angles[right] - wrapped, left, right)
    ranges = np.minimum(distances[nearest], specification.range)
    return np.where(np.abs(angles[nearest] - wrapped) <= max_gap, ranges, np.nan)
