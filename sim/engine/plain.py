"""The task written plainly: one robot, one pymunk Space, public queries, no compiled code.

This is what the compiled kernels must agree with (tests/sim/test_agreement.py), and the loop that
benchmarks/sim_throughput.py compares them with. It follows the paper's equations line by line.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pymunk
from numpy.typing import NDArray

from sim.actions import action_layout, twists
from sim.arenas import Arena
from sim.config import (
    ActionsPart,
    AddedObservationPart,
    BearingPart,
    DeviationPart,
    DirectionPart,
    DistancePart,
    DwellPart,
    FormulaTerm,
    HeadingPart,
    KnownPart,
    ObservationPart,
    OpeningsPart,
    RangesPart,
    ReachPart,
    RewardTerm,
    SpeedsPart,
    TaskConfig,
    TrailPart,
    WayPart,
)
from sim.engine.added_parts import AddedParts
from sim.engine.footprint import rectangle_clearance
from sim.engine.paths import Paths
from sim.engine.physics import add_arena, robot_body
from sim.engine.plain_dwell import PlainDwell
from sim.engine.plain_known import seen_known
from sim.engine.plain_openings import PlainOpenings
from sim.engine.plain_reach import seen_reach
from sim.engine.plain_trail import PlainTrail
from sim.engine.plain_views import PlainViews
from sim.engine.plain_way import seen_way
from sim.engine.rewards import constants, evaluate, parameters_of, program_of
from sim.extending.observing import Sight
from sim.extending.parts import RewardTerm as AddedTerm
from sim.lidar import drawn_ray_angles, ray_origins
from sim.observations import near_distance

Outcome = Literal["none", "arrival", "collision", "timeout"]

_AHEAD = math.radians(30.0)
_MAX_RATIO = 8.0


def exact_arc(
    pose: tuple[float, float, float], linear: float, angular: float, time: float, lateral: float = 0.0
) -> tuple[float, float, float]:
    """Where a body ends that keeps its speeds forwards and to the left, m/s, and its turning rate, rad/s, for `time` s."""
    x, y, heading = pose
    # The chord of a circle of radius v/w; as a difference of sines it would cancel in slow turns.
    half = angular * time / 2.0
    seconds = 2.0 / angular * math.sin(half) if abs(angular) >= 1e-12 else time
    cos, sin = math.cos(heading + half), math.sin(heading + half)
    return (
        x + seconds * (linear * cos - lateral * sin),
        y + seconds * (linear * sin + lateral * cos),
        heading + angular * time,
    )


def wrapped(angle: float) -> float:
    """The same direction in [-pi, pi]."""
    return math.atan2(math.sin(angle), math.cos(angle))


@dataclass
class Step:
    """What one step gave: the observation before any new target, the reward and how the attempt ended."""

    observation: NDArray[np.float64]
    reward: float
    terms: tuple[float, ...]
    outcome: Outcome


class PlainWorld:
    """One robot that drives to one target.

    Args:
        task: arena's limits, robot, LiDAR, observation, reward.
        arena: where it drives.
        pose: x, y, heading at the start, metres and radians.
        target: x, y, metres.
        field_of_view: degrees that the rays cover where it is not the LiDAR's (`sim.config.RandomisationConfig`).
    """

    def __init__(
        self,
        task: TaskConfig,
        arena: Arena,
        pose: tuple[float, float, float],
        target: tuple[float, float],
        field_of_view: float | None = None,
    ) -> None:
        self.task = task
        self.arena = arena
        self.space = pymunk.Space()
        self.space.collision_slop = 0.0
        self.space.collision_bias = 1.0
        self.obstacles = add_arena(self.space, arena, 0.0, 0.0)
        self.body, self.shape = robot_body(task.robot)
        self.shape.filter = pymunk.ShapeFilter(group=1)
        self.space.add(self.body, self.shape)
        self.body.position = pose[:2]
        self.body.angle = pose[2]
        self.target = target
        self.steps = 0
        self.velocities: tuple[float, ...] = (0.0,) * action_layout(task.robot).size
        self.last_velocities = self.velocities
        self.distance = math.dist(pose[:2], target)
        self._paths = Paths([arena], task.path_clearance) if task.reward.weight("path_progress") else None
        self.path = self.last_path = self._path()
        self._angles = drawn_ray_angles(task.lidar, field_of_view or task.lidar.field_of_view).tolist()
        self._trail = PlainTrail(task.lidar)
        self._trail.drop(pose[:2])
        self._dwell = PlainDwell(pose, task.control_period)
        self._views = PlainViews(task.lidar)
        self._openings = PlainOpenings(task.lidar, near_distance(task), self._views)
        self._sees_views = any(isinstance(part, KnownPart | OpeningsPart) for part in task.observation.parts)
        self._keep_view(self.scan())
        self._seen: list[list[NDArray[np.float64]]] = []
        self._added_parts = AddedParts(task)
        if task.observation.frames > 1:
            self.observe(self.scan())

    def scan(self) -> NDArray[np.float64]:
        """(scan,) metres, by Chipmunk's ray queries."""
        limit = self.task.lidar.range
        here = self.body.position
        origins = ray_origins(self.task.lidar, [(here.x, here.y, self.body.angle)])[0].tolist()
        ranges = np.full(len(self._angles), limit)
        for k, (angle, (x, y)) in enumerate(zip(self._angles, origins, strict=True)):
            direction = self.body.angle + angle
            end = (x + limit * math.cos(direction), y + limit * math.sin(direction))
            hit = self.space.segment_query_first((x, y), end, 0.0, self.shape.filter)
            if hit is not None:
                ranges[k] = hit.alpha * limit
        return ranges

    def nearest_to_middle(self, ranges: NDArray[np.float64]) -> float:
        """Distance of the nearest thing that a ray meets from the middle of the body, metres; infinite where none does."""
        start = ray_origins(self.task.lidar, [(0.0, 0.0, 0.0)])[0]
        ends = start + ranges[:, None] * np.stack([np.cos(self._angles), np.sin(self._angles)], axis=1)
        away = np.hypot(*ends.T)[ranges < self.task.lidar.range]
        return float(away.min(initial=math.inf))

    def clearance(self) -> float:
        """Distance from the body to the nearest shape, metres, negative in contact: of a disc by Chipmunk's point query."""
        if extents := self.task.robot.half_extents:
            return rectangle_clearance(self.arena, (*self.body.position, self.body.angle), *extents)
        reach = self.arena.diagonal
        hit = self.space.point_query_nearest(self.body.position, reach, self.shape.filter)
        return (hit.distance if hit is not None else reach) - self.task.robot.inscribed_radius

    def _path(self) -> float:
        """Length of the shortest path to the target, metres; 0 where the reward does not depend on it."""
        return 0.0 if self._paths is None else self._paths.length(0, self.body.position, self.target)

    def bearing(self) -> float:
        """Direction of the target against the heading, radians, left positive."""
        here = self.body.position
        return wrapped(math.atan2(self.target[1] - here.y, self.target[0] - here.x) - self.body.angle)

    def observe(self, ranges: NDArray[np.float64]) -> NDArray[np.float64]:
        """The task's observation after a step: what it sees now before what it saw earlier, see `sim.observations`."""
        parts = self.task.observation.parts
        self._trail.drop(self.body.position)
        self._keep_view(ranges)
        now = [self._part(part, ranges) for part in parts]
        self._seen = [now, *(self._seen or [now] * self.task.observation.frames)][: self.task.observation.frames]
        return np.concatenate(
            [seen[k] for age, seen in enumerate(self._seen) for k, part in enumerate(parts) if age < part.frames]
        )

    def _keep_view(self, ranges: NDArray[np.float64]) -> None:
        if self._sees_views:
            is_kept = self._views.keep(ranges, (*self.body.position, self.body.angle))
            self._openings.follow(self.steps, (float(self.target[0]), float(self.target[1])), is_kept=is_kept)

    def _part(self, part: ObservationPart, ranges: NDArray[np.float64]) -> NDArray[np.float64]:
        """The numbers of one part, see `sim.config.observation`."""
        task, bearing, heading = self.task, self.bearing(), wrapped(self.body.angle)
        match part:
            case RangesPart():
                nearest = ranges.reshape(part.batches * len(task.lidar.mount.places), -1).min(axis=1)
                near = near_distance(task)
                return np.asarray(near / np.maximum(nearest, near) if part.inverse else nearest / task.lidar.range)
            case SpeedsPart() | ActionsPart():  # nothing is late here
                return np.array(self.velocities)
            case DistancePart():
                scale = self.arena.diagonal if part.scaling == "diagonal" else self.distance + 1.0
                return np.array([self.distance / scale])
            case DirectionPart():
                return np.array([(bearing + heading) % math.tau / math.tau])
            case BearingPart(encoding="sine_cosine"):
                return np.array([math.sin(bearing), math.cos(bearing)])
            case BearingPart():
                return np.array([bearing / math.pi])
            case HeadingPart():
                return np.array([heading % math.tau / math.tau if part.scaling == "turn" else heading / math.pi])
            case DeviationPart():
                return np.array([abs(bearing) / math.pi])
            case TrailPart():
                return self._trail.seen(ranges, (*self.body.position, heading), part)
            case WayPart():
                return seen_way(ranges, bearing, self.distance, task)
            case ReachPart():
                return seen_reach(ranges, bearing, self.distance, part, task)
            case KnownPart():
                return seen_known(self._views.kept, ranges, (*self.body.position, heading), self.target, part, task.lidar)
            case OpeningsPart():
                return self._openings.seen(ranges, (*self.body.position, heading), part)
            case DwellPart():
                return np.array([self._dwell.seen(self.body.position, self.steps)])
            case AddedObservationPart():
                return np.asarray(self._added_parts.seen(self._sight(ranges))[part.name][0], np.float64)

    def _sight(self, ranges: NDArray[np.float64]) -> Sight:
        """What extensions see of it."""
        here, velocities = self.body.position, np.array([self.velocities], np.float32)
        return Sight(
            ranges=ranges[None].astype(np.float32),
            poses=np.array([[here.x, here.y, wrapped(self.body.angle)]], np.float32),
            targets=np.array([self.target], np.float32),
            speeds=velocities,
            actions=velocities,
        )

    def reward_terms(self, before: float, ranges: NDArray[np.float64], outcome: Outcome) -> tuple[float, ...]:
        """The reward's terms for a step that began `before` metres from the target (paper, Eq. 4 and 5)."""
        return tuple(term.weight * self._worth(term, before, ranges, outcome) for term in self.task.reward.terms)

    def _worth(self, term: RewardTerm, before: float, ranges: NDArray[np.float64], outcome: Outcome) -> float:
        """A term before its weight, see `sim.config.reward`."""
        if isinstance(term, FormulaTerm | AddedTerm):
            return evaluate(program_of(term), self._quantities(before, ranges, outcome) | parameters_of(term))
        if term.name in ("arrival", "collision", "timeout"):
            return float(term.name == outcome)
        if outcome in ("arrival", "collision"):
            return 0.0
        changes = np.subtract(self.velocities, self.last_velocities)
        match term.name:
            case "progress":
                ratio = min(before / self.distance, _MAX_RATIO)
                return (before - self.distance) * (2.0**ratio if term.exponential else 1.0)
            case "path_progress":
                return self.last_path - self.path
            case "time":
                return self.task.control_period
            case "clearance":
                return 1.0 - self._ahead(ranges) / self.task.lidar.range
            case "proximity":
                return max(0.0, 1.0 - max(self.clearance(), 0.0) / term.margin)
            case "alignment":
                return abs(self.bearing()) / math.pi
            case "smoothness":
                return float(changes @ changes)
            case "speed":
                return self.task.robot.max_linear_speed * self.velocities[0]
            case _:  # people: nothing moves here
                return 0.0

    def _ahead(self, ranges: NDArray[np.float64]) -> float:
        """Free distance within 30 degrees of the heading, metres."""
        off = np.abs([wrapped(angle) for angle in self._angles])
        return float(ranges[off <= max(_AHEAD, off.min()) + 1e-6].min())

    def _quantities(self, before: float, ranges: NDArray[np.float64], outcome: Outcome) -> dict[str, float]:
        """What formulas may read, see `sim.extending.expression`."""
        (speed, _, turn), (last_speed, _, last_turn) = twists(self.task.robot, [self.velocities, self.last_velocities])
        return constants(self.task) | {
            "distance": self.distance,
            "previous_distance": before,
            "bearing": self.bearing(),
            "heading": wrapped(self.body.angle),
            "speed": speed,
            "turning_rate": turn,
            "last_speed": last_speed,
            "last_turning_rate": last_turn,
            "clearance": self.clearance(),
            "ahead": self._ahead(ranges),
            "nearest": float(ranges.min()),
            "mover": 100.0,
            "steps": float(self.steps),
            "arrived": float(outcome == "arrival"),
            "collided": float(outcome == "collision"),
            "timed_out": float(outcome == "timeout"),
        }

    def step(self, *action: float) -> Step:
        """Drive for one control period by an action, fractions of the limits within their ranges (`sim.actions`)."""
        task = self.task
        forwards, aside, turn = twists(task.robot, [action])[0].tolist()
        half = turn * task.control_period / 2.0
        chord = math.sin(half) / half if half else 1.0
        direction = self.body.angle + half
        self.body.velocity = (
            chord * (forwards * math.cos(direction) - aside * math.sin(direction)),
            chord * (forwards * math.sin(direction) + aside * math.cos(direction)),
        )
        self.body.angular_velocity = turn
        self.space.step(task.control_period)

        self.steps += 1
        self.last_velocities, self.velocities = self.velocities, action
        before, self.distance = self.distance, math.dist(self.body.position, self.target)
        self.last_path, self.path = self.path, self._path()
        ranges = self.scan()
        outcome: Outcome = "none"
        if self.distance < task.arrival_distance:
            outcome = "arrival"
        elif self.clearance() < 0.0 or self.nearest_to_middle(ranges) < task.collision_distance:
            outcome = "collision"
        elif self.steps >= task.step_limit:
            outcome = "timeout"
        terms = self.reward_terms(before, ranges, outcome)
        return Step(self.observe(ranges), sum(terms), terms, outcome)
