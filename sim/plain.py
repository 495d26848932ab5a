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

from sim.arenas import Arena
from sim.config import FormulaTerm, RewardTerm, TaskConfig
from sim.footprint import rectangle_clearance
from sim.lidar import drawn_ray_angles
from sim.observations import near_distance
from sim.physics import add_arena, robot_body
from sim.rewards import constants, evaluate

Outcome = Literal["none", "arrival", "collision", "timeout"]

_AHEAD = math.radians(30.0)
_MAX_RATIO = 8.0


def exact_arc(pose: tuple[float, float, float], linear: float, angular: float, time: float) -> tuple[float, float, float]:
    """Where a differential drive ends that keeps its velocities, in m/s and rad/s, for `time` seconds from `pose`."""
    x, y, heading = pose
    if abs(angular) < 1e-12:
        return x + linear * time * math.cos(heading), y + linear * time * math.sin(heading), heading
    # The chord of a circle of radius v/w; as a difference of sines it would cancel in slow turns.
    half = angular * time / 2.0
    chord = 2.0 * linear / angular * math.sin(half)
    return x + chord * math.cos(heading + half), y + chord * math.sin(heading + half), heading + angular * time


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
        self.velocities = self.last_velocities = (0.0, 0.0)
        self.distance = math.dist(pose[:2], target)
        self._angles = drawn_ray_angles(task.lidar, field_of_view or task.lidar.field_of_view).tolist()

    def scan(self) -> NDArray[np.float64]:
        """(rays,) metres, by Chipmunk's ray queries."""
        limit = self.task.lidar.range
        here = self.body.position
        ranges = np.full(len(self._angles), limit)
        for k, angle in enumerate(self._angles):
            direction = self.body.angle + angle
            end = (here.x + limit * math.cos(direction), here.y + limit * math.sin(direction))
            hit = self.space.segment_query_first(here, end, 0.0, self.shape.filter)
            if hit is not None:
                ranges[k] = hit.alpha * limit
        return ranges

    def clearance(self) -> float:
        """Distance from the body to the nearest shape, metres, negative in contact: of a disc by Chipmunk's point query."""
        if extents := self.task.robot.half_extents:
            return rectangle_clearance(self.arena, (*self.body.position, self.body.angle), *extents)
        reach = self.arena.diagonal
        hit = self.space.point_query_nearest(self.body.position, reach, self.shape.filter)
        return (hit.distance if hit is not None else reach) - self.task.robot.inscribed_radius

    def bearing(self) -> float:
        """Direction of the target against the heading, radians, left positive."""
        here = self.body.position
        return wrapped(math.atan2(self.target[1] - here.y, self.target[0] - here.x) - self.body.angle)

    def observe(self, ranges: NDArray[np.float64]) -> NDArray[np.float64]:
        """The task's observation, see `sim.observations`."""
        task = self.task
        nearest = ranges.reshape(task.lidar.batches, -1).min(axis=1)
        bearing, heading = self.bearing(), wrapped(self.body.angle)
        if task.observation == "paper":
            scan = nearest / task.lidar.range
            polar = (
                self.distance / self.arena.diagonal,
                (bearing + heading) % math.tau / math.tau,
                heading % math.tau / math.tau,
            )
        else:
            near = near_distance(task)
            scan = near / np.maximum(nearest, near)
            polar = (self.distance / (self.distance + 1.0), bearing / math.pi, heading / math.pi)
        return np.array([*scan, *self.velocities, *polar, abs(bearing) / math.pi])

    def reward_terms(self, before: float, ranges: NDArray[np.float64], outcome: Outcome) -> tuple[float, ...]:
        """The reward's terms for a step that began `before` metres from the target (paper, Eq. 4 and 5)."""
        return tuple(term.weight * self._worth(term, before, ranges, outcome) for term in self.task.reward.terms)

    def _worth(self, term: RewardTerm, before: float, ranges: NDArray[np.float64], outcome: Outcome) -> float:
        """A term before its weight, see `sim.config.reward`."""
        if isinstance(term, FormulaTerm):
            return evaluate(term.formula, self._quantities(before, ranges, outcome))
        if term.name in ("arrival", "collision", "timeout"):
            return float(term.name == outcome)
        if outcome in ("arrival", "collision"):
            return 0.0
        changes = np.subtract(self.velocities, self.last_velocities)
        match term.name:
            case "progress":
                ratio = min(before / self.distance, _MAX_RATIO)
                return (before - self.distance) * (2.0**ratio if term.exponential else 1.0)
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
        return float(min(r for r, angle in zip(ranges, self._angles, strict=True) if abs(angle) <= _AHEAD))

    def _quantities(self, before: float, ranges: NDArray[np.float64], outcome: Outcome) -> dict[str, float]:
        """What formulas may read, see `sim.config.expression`."""
        limits = self.task.robot.max_linear_speed, self.task.robot.max_angular_speed
        return constants(self.task) | {
            "distance": self.distance,
            "previous_distance": before,
            "bearing": self.bearing(),
            "heading": wrapped(self.body.angle),
            "speed": limits[0] * self.velocities[0],
            "turning_rate": limits[1] * self.velocities[1],
            "last_speed": limits[0] * self.last_velocities[0],
            "last_turning_rate": limits[1] * self.last_velocities[1],
            "clearance": self.clearance(),
            "ahead": self._ahead(ranges),
            "nearest": float(ranges.min()),
            "mover": 100.0,
            "steps": float(self.steps),
            "arrived": float(outcome == "arrival"),
            "collided": float(outcome == "collision"),
            "timed_out": float(outcome == "timeout"),
        }

    def step(self, linear: float, angular: float) -> Step:
        """Drive for one control period; `linear` in [0, 1] and `angular` in [-1, 1] are fractions of the limits."""
        task = self.task
        turn = angular * task.robot.max_angular_speed
        half = turn * task.control_period / 2.0
        speed = linear * task.robot.max_linear_speed * (math.sin(half) / half if half else 1.0)
        direction = self.body.angle + half
        self.body.velocity = speed * math.cos(direction), speed * math.sin(direction)
        self.body.angular_velocity = turn
        self.space.step(task.control_period)

        self.steps += 1
        self.last_velocities, self.velocities = self.velocities, (linear, angular)
        before, self.distance = self.distance, math.dist(self.body.position, self.target)
        ranges = self.scan()
        outcome: Outcome = "none"
        if self.distance < task.arrival_distance:
            outcome = "arrival"
        elif self.clearance() < 0.0 or ranges.min() < task.collision_distance:
            outcome = "collision"
        elif self.steps >= task.step_limit:
            outcome = "timeout"
        terms = self.reward_terms(before, ranges, outcome)
        return Step(self.observe(ranges), sum(terms), terms, outcome)
