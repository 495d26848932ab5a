"""What the planners make of a scan: points in the robot's frame, and the body that has to pass between them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.config import TaskConfig
from sim.errors import BaselineError
from sim.lidar import drawn_ray_angles, ray_origins
from sim.suites import Situation

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """What has to keep clear: a rectangle, or a disc where `half_length` is 0; metres.

    Attributes:
        half_length, half_width: of the rectangle.
        radius: of a disc around the body, or of the disc that a collision's distance makes of it.
    """

    half_length: float
    half_width: float
    radius: float

    @classmethod
    def of(cls, task: TaskConfig) -> "Body":
        """The body of a task's robot, with the distance at which a ray counts as a collision around it."""
        half_length, half_width = task.robot.half_extents or (0.0, 0.0)
        return cls(half_length, half_width, task.passable_clearance)


class Scans:
    """Scans of a task's LiDAR as points."""

    def __init__(self, task: TaskConfig) -> None:
        self.angles = drawn_ray_angles(task.lidar, [task.lidar.field_of_view])[0]
        self.limit = task.lidar.range
        self._lidar = task.lidar
        self._directions = np.stack([np.cos(self.angles), np.sin(self.angles)], axis=1)
        self._origins = self.origins(np.zeros((1, 3)))[0]

    def points(self, situation: Situation) -> tuple[Doubles, NDArray[np.int64]]:
        """What was hit, (n, rays, 2) in each robot's frame, nearest first, metres; and (n,) how many of them count."""
        ranges = situation.ranges.astype(np.float64)
        order = np.argsort(ranges, axis=1, kind="stable")
        nearest = np.take_along_axis(ranges, order, axis=1)
        points = self._origins[order] + nearest[..., None] * self._directions[order]
        return points, (ranges < self.limit).sum(axis=1)

    def origins(self, poses: Doubles) -> Doubles:
        """(n, rays, 2) where the rays begin of robots at poses (n, 3), metres."""
        return ray_origins(self._lidar, poses)

    def polar(self, situation: Situation) -> tuple[Doubles, Doubles]:
        """(n, rays) metres and radians from the robots' middles to what was hit, as if the LiDAR were there.

        What hits nothing reads the full range, in its ray's direction.
        """
        ranges = situation.ranges.astype(np.float64)
        points = self._origins + ranges[..., None] * self._directions
        hit = ranges < self.limit
        away = np.minimum(np.hypot(points[..., 0], points[..., 1]), np.nextafter(self.limit, 0.0))
        angles = np.arctan2(points[..., 1], points[..., 0])
        return np.where(hit, away, self.limit), np.where(hit, angles, self.angles)


def goals(situation: Situation) -> Doubles:
    """(n, 2) the targets in each robot's frame, metres."""
    return in_frames(situation.poses, situation.targets)


def in_frames(poses: NDArray[np.float32], places: NDArray[np.floating]) -> Doubles:
    """(n, 2) places in the frames of poses (n, 3), metres."""
    away = places.astype(np.float64) - poses[:, :2]
    cos, sin = np.cos(poses[:, 2].astype(np.float64)), np.sin(poses[:, 2].astype(np.float64))
    return np.stack([cos * away[:, 0] + sin * away[:, 1], cos * away[:, 1] - sin * away[:, 0]], axis=1)


@dataclass(frozen=True)
class Drive:
    """A drive's limits as the planners need them; velocities as fractions of the top ones."""

    top_linear: float
    top_angular: float
    linear_change: float
    angular_change: float

    @classmethod
    def of(cls, task: TaskConfig) -> "Drive":
        """Of a task's robot: how much its velocities change in one step, 2 where acceleration is unlimited.

        Raises:
            BaselineError: the robot's drive is not one that is planned for.
        """
        if task.robot.drive.name != "differential":
            raise BaselineError(
                f"the planners plan for a differential drive, and this robot's is {task.robot.drive.name}: compare with "
                "go-to-goal, or with a policy"
            )
        robot, period = task.robot, task.control_period
        linear = robot.max_linear_acceleration * period / robot.max_linear_speed
        angular = robot.max_angular_acceleration * period / robot.max_angular_speed
        return cls(robot.max_linear_speed, robot.max_angular_speed, linear or 2.0, angular or 2.0)

    def fractions(self, situation: Situation) -> Doubles:
        """(n, 2) the robots' velocities."""
        return situation.velocities.astype(np.float64) / (self.top_linear, self.top_angular)
