"""Decides every command: the policy's while all is well, a stop in every other case. Without ROS, so that it can be tested.

Times are seconds of one clock of the caller's choice; lengths metres, angles radians.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from .dwell import Dwell
from .observation import Frames, Reals, Scan, observe, refuse_unknown, resample, wrap
from .openings import Openings
from .policy import Floats, Policy, Specification
from .trail import Trail
from .views import Views

_MEMORIES: Mapping[str, type[Trail | Dwell | Views | Openings]] = {
    "trail": Trail,
    "dwell": Dwell,
    "views": Views,
    "openings": Openings,
}


class State(Enum):
    """Why the robot drives or stands."""

    DRIVING = "driving"
    NO_GOAL = "waiting for a goal"
    ARRIVED = "arrived"
    NO_ODOMETRY = "stopped: no odometry yet"
    STALE_ODOMETRY = "stopped: odometry is stale"
    NO_FRAME = "stopped: the place of the goal's frame is not known yet"
    STALE_FRAME = "stopped: the place of the goal's frame is stale"
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
        transform_timeout: seconds after which the newest place of a goal's frame is.
        goal_tolerance: distance to the goal that counts as arrived.
        max_linear_speed, max_angular_speed: limits below the policy's slow it down on the same arc.
        sensor_yaw, second_sensor_yaw: of the x axis of each LiDAR's scan against the heading.
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
    second_sensor_yaw: float = 0.0
    max_gap: float = 0.0873  # 5 degrees
    transform_timeout: float = 1.0

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
            sensor_yaw=specification.mounts[0][2],
            second_sensor_yaw=specification.mounts[-1][2] if len(specification.mounts) > 1 else 0.0,
        )


@dataclass(frozen=True)
class Command:
    """Velocities to send, m/s and rad/s, and why; of an Ackermann drive the steering angle too, rad."""

    linear: float
    angular: float
    state: State
    lateral: float = 0.0
    steering: float = 0.0


def outline(specification: Specification, angles: Reals) -> Reals:
    """Distance from the middle of a rectangular body to its edge at angles against the heading, metres."""
    half_length, half_width = 0.5 * specification.robot_length, 0.5 * specification.robot_width
    edge: Reals = np.minimum(
        half_length / np.maximum(np.abs(np.cos(angles)), 1e-9), half_width / np.maximum(np.abs(np.sin(angles)), 1e-9)
    )
    return edge


MakeAdded = Callable[[Reals, Reals, Reals, Reals, Reals], Mapping[str, Reals]]
"""Scan (1, scan), pose (1, 3), goal (1, 2), last action (1, A) and speeds (1, A), as `observe` takes them, to the numbers
(1, size) of the parts that an extension's code makes, by their kinds."""


class Navigator:
    """Keeps the newest scan, pose and goal; `command` is called once per control period.

    Args:
        policy: the exported policy.
        safety: when to stop.
        make_added: makes what an extension's code made in training, where the policy sees such parts.

    Raises:
        PolicyFileError: the policy sees such a part, and there is nothing that makes it.
    """

    def __init__(self, policy: Policy, safety: Safety, make_added: MakeAdded | None = None) -> None:
        if make_added is None:
            refuse_unknown(
                policy.specification, tuple(part.kind for part in policy.specification.parts if part.remembered_by)
            )
        self._policy, self._safety, self._make_added = policy, safety, make_added
        self._scans: list[tuple[float, Scan] | None] = [None] * len(policy.specification.mounts)
        self._yaws = (safety.sensor_yaw, safety.second_sensor_yaw)[: len(self._scans)]
        self._pose: tuple[float, tuple[float, float, float]] | None = None
        self._velocities: tuple[float, float, float] | None = None
        self._goal: tuple[float, float] | None = None
        self._goal_frame = ""
        self._place: tuple[float, tuple[float, float, float]] | None = None
        self._arrived = False
        self._too_near = False
        self._last_action = np.zeros(len(policy.specification.action_limits), np.float32)
        self._frames = Frames(policy.specification)
        self._ways = tuple(
            _MEMORIES[part.remembered_by](policy.specification) for part in policy.specification.parts if part.remembered_by
        )
        self._memory = policy.memory(1)

    def set_scan(self, at: float, scan: Scan, lidar: int = 0) -> None:
        """A scan of one of the LiDARs, measured at that time."""
        self._scans[lidar] = (at, scan)

    def set_odometry(
        self, at: float, x: float, y: float, heading: float, velocities: tuple[float, float, float] | None = None
    ) -> None:
        """The robot's pose in the odometry's frame, and how fast it drives forwards, to the left and turns, if measured."""
        self._pose = (at, (x, y, heading))
        self._velocities = velocities

    def set_goal(self, x: float, y: float, frame: str = "") -> None:
        """Where to go; further from the last goal than arriving allows, the way to it begins here.

        Args:
            x: of the goal in the frame.
            y: likewise.
            frame: whose place `place_goal_frame` tells, again and again where it moves; empty: the odometry's.
        """
        moved = (
            self._goal is None or frame != self._goal_frame or math.dist(self._goal, (x, y)) > self._safety.goal_tolerance
        )
        if moved:
            for way in self._ways:
                way.clear()
        if frame != self._goal_frame:
            self._place = None
        self._goal, self._goal_frame, self._arrived = (x, y), frame, False

    @property
    def goal_frame(self) -> str:
        """Of the goal that is driven to; empty: the odometry's, or there is no goal."""
        return self._goal_frame if self._goal is not None else ""

    def place_goal_frame(self, at: float, x: float, y: float, heading: float) -> None:
        """Where the goal's frame lay in the odometry's then, and how far it was turned."""
        self._place = (at, (x, y, heading))

    def cancel(self) -> None:
        """Stay where it is."""
        self._goal, self._arrived = None, False

    def command(self, now: float) -> Command:
        """What to send to the robot now."""
        state, observation = self._look(now)
        if observation is None:
            return self._stop(state)
        actions, self._memory = self._policy.step(observation, self._memory)
        action = actions[0]
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
        if self._goal_frame and self._place is None:
            return State.NO_FRAME, None
        if self._goal_frame and self._place is not None and now - self._place[0] > safety.transform_timeout:
            return State.STALE_FRAME, None
        scans: list[Scan] = []
        for newest in self._scans:
            if newest is None:
                return State.NO_SCAN, None
            if now - newest[0] > safety.scan_timeout:
                return State.STALE_SCAN, None
            scans.append(newest[1])
        pose, goal = np.array(self._pose[1]), self._goal_by_odometry(self._goal)
        if not (np.isfinite(pose).all() and np.isfinite(goal).all() and np.isfinite(self._speeds()).all()):
            return State.NOT_FINITE, None
        if np.hypot(*(goal - pose[:2])) < safety.goal_tolerance:
            self._goal, self._arrived = None, True
            return State.ARRIVED, None
        self._too_near = any(self._is_too_near(scan, lidar) for lidar, scan in enumerate(scans))
        if self._too_near:
            return State.TOO_NEAR, None
        specification = self._policy.specification
        ranges = np.concatenate(
            [resample(scan, specification, self._yaws[lidar], safety.max_gap, lidar) for lidar, scan in enumerate(scans)]
        )
        if np.isnan(ranges).any():
            return State.BLIND, None
        known = (
            ranges[None],
            pose[None],
            goal[None],
            self._last_action[None].astype(float),
            self._speeds()[None].astype(float),
        )
        added = dict(self._make_added(*known)) if self._make_added else {}
        for way in self._ways:
            seen = way.see(ranges, pose) if isinstance(way, Trail | Dwell) else way.see(ranges, pose, goal)
            added[way.kind] = seen[None]
        moment = observe(specification, *known, added=added)
        return State.DRIVING, self._frames.push(moment)

    def _goal_by_odometry(self, goal: tuple[float, float]) -> Reals:
        """The goal in the odometry's frame, (2,)."""
        if not self._goal_frame or self._place is None:
            return np.array(goal)
        x, y, heading = self._place[1]
        cos, sin = math.cos(heading), math.sin(heading)
        return np.array((x + cos * goal[0] - sin * goal[1], y + sin * goal[0] + cos * goal[1]))

    def _speeds(self) -> Floats:
        """What the robot does as fractions of its limits, (A,): its speeds as measured, else as last commanded."""
        if self._velocities is None:
            return self._last_action
        forwards, aside, turn = self._velocities
        specification = self._policy.specification
        measured = np.array((forwards, turn) if specification.drive == "differential" else (forwards, aside, turn))
        if specification.drive == "ackermann":  # odometry tells no steering angle
            measured = np.array((forwards, self._last_action[1] * specification.steering_limit))
        return np.clip(measured / specification.action_limits, specification.action_lows, 1.0).astype(np.float32)

    def _is_too_near(self, scan: Scan, lidar: int) -> bool:
        """Whether a beam meets something nearer to the body than may be; once one did, all must clear a margin more."""
        safety = self._safety
        margin = safety.resume_margin if self._too_near else 0.0
        specification, angles = self._policy.specification, scan.angles(self._yaws[lidar])
        x, y, yaw = specification.mounts[lidar]
        ahead = np.abs(wrap(angles - yaw)) <= specification.field_of_view / 2.0 + 1e-6
        distances = scan.distances()
        if x or y:
            # As seen from the middle of the body; what is infinitely far stays so.
            met = np.isfinite(distances)
            reach = np.where(met, distances, 0.0)
            meets_x, meets_y = x + reach * np.cos(angles), y + reach * np.sin(angles)
            angles = np.where(met, np.arctan2(meets_y, meets_x), angles)
            distances = np.where(met, np.hypot(meets_x, meets_y), distances)
        allowed = np.where(ahead, safety.stop_distance, safety.body_distance)
        if specification.robot_length:
            allowed = np.maximum(allowed, safety.body_distance / specification.robot_radius * outline(specification, angles))
        allowed = allowed + margin
        # Comparisons with nan, an unknown distance, are false.
        return bool((distances < allowed).any())

    def _drive(self, action: Floats) -> Command:
        """The action as velocities, slower on the same arc where a limit asks for it."""
        specification, safety = self._policy.specification, self._safety
        commands = action.astype(np.float64) * specification.action_limits
        linear, steering = float(commands[0]), 0.0
        lateral = float(commands[1]) if specification.drive == "omnidirectional" else 0.0
        angular = float(commands[-1])
        if specification.drive == "ackermann":
            curvature = math.tan(angular) / specification.wheel_base
            # As in training it steers less where it would turn faster than it may.
            curvature *= min(1.0, specification.max_angular_speed / max(abs(curvature * linear), 1e-9))
            angular, steering = linear * curvature, math.atan(curvature * specification.wheel_base)
        slower = min(
            1.0,
            safety.max_linear_speed / max(abs(linear), abs(lateral), 1e-9),
            safety.max_angular_speed / max(abs(angular), 1e-9),
        )
        followed = np.full(len(action), slower, np.float32)
        if specification.drive == "ackermann":
            followed[1] = 1.0  # an angle, and no speed
        self._last_action = (action * followed).astype(np.float32)
        return Command(linear * slower, angular * slower, State.DRIVING, lateral * slower, steering)

    def _stop(self, state: State) -> Command:
        self._frames.clear()
        self._memory = self._policy.memory(1)
        self._last_action = np.zeros_like(self._last_action)
        return Command(0.0, 0.0, state)
