"""Decides every command: the policy's while all is well, a stop in every other case. Without ROS, so that it can be tested.

Times are seconds of one clock of the caller's choice; lengths metres, angles radians.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from .observation import Frames, Reals, Scan, observe, ray_angles, resample
from .policy import Floats, Policy, Specification


class State(Enum):
    """Why the robot drives or stands."""

    DRIVING = "driving"
    NO_GOAL = "waiting for a goal"
    ARRIVED = "arrived"
    NO_ODOMETRY = "stopped: no odometry yet"
    STALE_ODOMETRY = "stopped: odometry is stale"
    NO_SCAN = "stopped: no scan yet"
    STALE_SCAN = "stopped: scan is stale"
    BLIND = "stopped: scan does not cover the policy's field of view"
    TOO_NEAR = "stopped: an obstacle is too near"
    NOT_FINITE = "stopped: numbers are not finite"


@dataclass(frozen=True)
class Safety:
    """When to stop, and how fast to drive at most.

    Attributes:
        stop_distance: a beam within the policy's field of view shorter than this stops the robot.
        body_distance: the same for beams beside and behind; of a rectangular body at its nearest side, and all round in
            proportion to its outline.
        resume_margin: metres more than either that let it drive again.
        scan_timeout, odometry_timeout: seconds after which the newest message is stale.
        goal_tolerance: distance to the goal that counts as arrived.
        max_linear_speed, max_angular_speed: limits below the policy's slow it down on the same arc.
        sensor_yaw: of the LiDAR against the heading.
        max_gap: largest angle between a ray of the policy and the beam that stands for it.
    """

    stop_distance: float
    body_distance: float
    resume_margin: float
    scan_timeout: float
    odometry_timeout: float
    goal_tolerance: float
    max_linear_speed: float
    max_angular_speed: float
    sensor_yaw: float = 0.0
    max_gap: float = 0.0873  # 5 degrees

    @classmethod
    def of(cls, specification: Specification) -> "Safety":
        """What the policy was trained with: stop where training saw a collision, arrive where it saw an arrival."""
        return cls(
            stop_distance=max(specification.collision_distance, specification.robot_radius),
            body_distance=specification.robot_radius + 0.02,
            resume_margin=0.05,
            scan_timeout=0.5,
            odometry_timeout=0.5,
            goal_tolerance=specification.arrival_distance,
            max_linear_speed=specification.max_linear_speed,
            max_angular_speed=specification.max_angular_speed,
        )


@dataclass(frozen=True)
class Command:
    """Velocities to send, m/s and rad/s, and why."""

    linear: float
    angular: float
    state: State


def outline(specification: Specification, angles: Reals) -> Reals:
    """Distance from the middle of a rectangular body to its edge at angles against the heading, metres."""
    half_length, half_width = 0.5 * specification.robot_length, 0.5 * specification.robot_width
    edge: Reals = np.minimum(
        half_length / np.maximum(np.abs(np.cos(angles)), 1e-9), half_width / np.maximum(np.abs(np.sin(angles)), 1e-9)
    )
    return edge


class Navigator:
    """Keeps the newest scan, pose and goal; `command` is called once per control period.

    Args:
        policy: the exported policy.
        safety: when to stop.
    """

    def __init__(self, policy: Policy, safety: Safety) -> None:
        self._policy, self._safety = policy, safety
        self._rays = ray_angles(policy.specification)
        self._scan: tuple[float, Scan] | None = None
        self._pose: tuple[float, tuple[float, float, float]] | None = None
        self._goal: tuple[float, float] | None = None
        self._arrived = False
        self._too_near = False
        self._last_action = np.zeros(2, np.float32)
        self._frames = Frames(policy.specification)

    def set_scan(self, at: float, scan: Scan) -> None:
        """A scan, measured at that time."""
        self._scan = (at, scan)

    def set_odometry(self, at: float, x: float, y: float, heading: float) -> None:
        """The robot's pose in the goal's frame, measured at that time."""
        self._pose = (at, (x, y, heading))

    def set_goal(self, x: float, y: float) -> None:
        """Where to go."""
        self._goal, self._arrived = (x, y), False

    def cancel(self) -> None:
        """Stay where it is."""
        self._goal, self._arrived = None, False

    def command(self, now: float) -> Command:
        """What to send to the robot now."""
        state, observation = self._look(now)
        if observation is None:
            return self._stop(state)
        action = self._policy.actions(observation)[0]
        if not np.isfinite(action).all():
            return self._stop(State.NOT_FINITE)
        return self._drive(action)

    def _look(self, now: float) -> tuple[State, Floats | None]:
        """The observation if everything allows driving, else the reason why not."""
        safety = self._safety
        if self._goal is None:
            return (State.ARRIVED if self._arrived else State.NO_GOAL), None
        if self._pose is None:
            return State.NO_ODOMETRY, None
        if now - self._pose[0] > safety.odometry_timeout:
            return State.STALE_ODOMETRY, None
        if self._scan is None:
            return State.NO_SCAN, None
        if now - self._scan[0] > safety.scan_timeout:
            return State.STALE_SCAN, None
        pose, goal, scan = np.array(self._pose[1]), np.array(self._goal), self._scan[1]
        if not (np.isfinite(pose).all() and np.isfinite(goal).all()):
            return State.NOT_FINITE, None
        if np.hypot(*(goal - pose[:2])) < safety.goal_tolerance:
            self._goal, self._arrived = None, True
            return State.ARRIVED, None
        self._too_near = self._is_too_near(scan)
        if self._too_near:
            return State.TOO_NEAR, None
        specification = self._policy.specification
        ranges = resample(scan, specification, safety.sensor_yaw, safety.max_gap)
        if np.isnan(ranges).any():
            return State.BLIND, None
        frame = observe(specification, ranges[None], pose[None], goal[None], self._last_action[None])
        return State.DRIVING, self._frames.push(frame)

    def _is_too_near(self, scan: Scan) -> bool:
        """Whether a beam is shorter than it may be; once it was, all must clear a margin more."""
        safety = self._safety
        margin = safety.resume_margin if self._too_near else 0.0
        specification, angles = self._policy.specification, scan.angles(safety.sensor_yaw)
        ahead = np.abs(angles) <= specification.field_of_view / 2.0 + 1e-6
        allowed = np.where(ahead, safety.stop_distance, safety.body_distance)
        if specification.robot_length:
            allowed = np.maximum(allowed, safety.body_distance / specification.robot_radius * outline(specification, angles))
        allowed = allowed + margin
        # Comparisons with nan, an unknown distance, are false.
        return bool((scan.distances() < allowed).any())

    def _drive(self, action: Floats) -> Command:
        specification, safety = self._policy.specification, self._safety
        linear = float(action[0]) * specification.max_linear_speed
        angular = float(action[1]) * specification.max_angular_speed
        slower = min(
            1.0,
            safety.max_linear_speed / max(linear, 1e-9),
            safety.max_angular_speed / max(abs(angular), 1e-9),
        )
        self._last_action = (action * np.float32(slower)).astype(np.float32)
        return Command(linear * slower, angular * slower, State.DRIVING)

    def _stop(self, state: State) -> Command:
        self._frames.clear()
        self._last_action = np.zeros(2, np.float32)
        return Command(0.0, 0.0, state)
