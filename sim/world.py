"""The engine below the Gymnasium interfaces: many robots, each alone in its arena, stepped together."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.arenas import Arena, free_distance
from sim.arenas.freespace import FreeSpace, free_space
from sim.config import TaskConfig
from sim.errors import PlacementError
from sim.kernels.bundles import REWARD_TERMS, Geometry, Robots
from sim.kernels.random import seed_streams
from sim.kernels.records import (
    ALIGNMENT,
    BASIC,
    CLEARANCE,
    IMPROVED,
    PAPER,
    PARAMETERS,
    ROBOT,
)
from sim.kernels.step import reset_robots, step_robots, write_commands
from sim.lidar import ray_angles
from sim.observations import near_distance, observation_size
from sim.physics import ROBOTS_PER_TILE, TiledSpace, tile_origins
from sim.shapes import pack_shapes

SPAWN_MARGIN = 0.2
"""Metres that starts and targets keep from obstacles beyond what a robot needs to pass: 0.4 m in all by default."""

AHEAD = math.radians(30.0)
"""Rays within this angle of the heading tell how free the way ahead is (the `clearance` reward)."""

_OBSERVATIONS = {"paper": PAPER, "improved": IMPROVED}
_REWARDS = {"basic": BASIC, "clearance": CLEARANCE, "alignment": ALIGNMENT}


def passable_clearance(task: TaskConfig) -> float:
    """Distance from obstacles that a robot's centre needs on its way, metres."""
    return max(task.robot.radius, task.collision_distance)


def spawn_space(task: TaskConfig, arena: Arena) -> FreeSpace:
    """Where this task's robots start and their targets stand in an arena.

    Raises:
        ArenaError: there is no such place.
    """
    passable = passable_clearance(task)
    return free_space(arena, passable=passable, clearance=passable + SPAWN_MARGIN)


def _largest_change(acceleration: float, limit: float, period: float) -> float:
    """Change of a velocity in one period as a fraction of its limit; 2, the whole span, where it is unlimited."""
    return min(2.0, acceleration * period / limit) if acceleration else 2.0


def pack_parameters(task: TaskConfig) -> NDArray[np.void]:
    """A task as the kernels read it: (1,) of `sim.kernels.records.PARAMETERS`."""
    angles = ray_angles(task.lidar)
    ahead = np.flatnonzero(np.abs(angles) <= AHEAD + 1e-9)
    if not len(ahead):  # a scanner so coarse that no ray points ahead: the middle ones
        ahead = np.flatnonzero(np.abs(angles) <= np.abs(angles).min() + 1e-9)
    parameters = np.zeros(1, dtype=PARAMETERS)
    values = {
        "period": task.control_period,
        "max_linear": task.robot.max_linear_speed,
        "max_angular": task.robot.max_angular_speed,
        "linear_change": _largest_change(
            task.robot.max_linear_acceleration, task.robot.max_linear_speed, task.control_period
        ),
        "angular_change": _largest_change(
            task.robot.max_angular_acceleration, task.robot.max_angular_speed, task.control_period
        ),
        "radius": task.robot.radius,
        "range": task.lidar.range,
        "noise": task.lidar.noise,
        "dropout": task.lidar.dropout,
        "looks_ahead": task.lidar.field_of_view <= 180.0,
        "batches": task.lidar.batches,
        "rays_per_batch": task.lidar.rays // task.lidar.batches,
        "observation": _OBSERVATIONS[task.observation],
        "near": near_distance(task),
        "reward": _REWARDS[task.reward.name],
        "arrival_reward": task.reward.arrival,
        "collision_reward": task.reward.collision,
        "progress": task.reward.progress,
        "penalty": task.reward.penalty,
        "ahead_first": ahead[0],
        "ahead_last": ahead[-1] + 1,
        "arrival_distance": task.arrival_distance,
        "collision_distance": task.collision_distance,
        "step_limit": task.step_limit,
        "spawn_clearance": passable_clearance(task) + SPAWN_MARGIN,
        # The body is checked at least once in every radius of the way, so that a fast one cannot jump through a wall.
        "path_samples": math.ceil(task.robot.max_linear_speed * task.control_period / task.robot.radius),
    }
    for name, value in values.items():
        parameters[name] = value
    return parameters


class World:
    """Robots in a pool of arenas: LiDAR, physics, outcomes, rewards, observations and resets.

    A robot goes on after an arrival, with a new target; after a collision or a time-out it starts anew, in an arena drawn
    from the pool. Its fate depends on the seed and its own index, never on the number of robots.

    Args:
        task: robot, LiDAR, observation, reward and limits.
        arenas: the pool.
        robots: how many.
        seed: of all that is random; None takes one from the operating system.
        respawn: False saves looking for free space where every pose and target is given: robots then stay where they end.

    Raises:
        ArenaError: the robot does not fit into an arena.

    Attributes:
        task: what all of it follows.
        arenas: the pool.
        robots: the arrays of all robots, overwritten by every step.
    """

    def __init__(
        self, task: TaskConfig, arenas: Sequence[Arena], robots: int, *, seed: int | None = None, respawn: bool = True
    ) -> None:
        self.task = task
        self.arenas = tuple(arenas)
        replicas = math.ceil(robots / (ROBOTS_PER_TILE * len(self.arenas)))
        origins = tile_origins(self.arenas, replicas)
        nowhere = np.empty((0, 2), dtype=np.float32)
        spaces = [spawn_space(task, arena) if respawn else FreeSpace(nowhere, nowhere, 0.0) for arena in self.arenas]
        bounds, circles, boxes = pack_shapes(self.arenas)
        angles = ray_angles(task.lidar)
        self.geometry = Geometry(
            bounds=bounds,
            circles=circles,
            boxes=boxes,
            starts=np.concatenate([space.starts for space in spaces]),
            targets=np.concatenate([space.targets for space in spaces]),
            start_offsets=np.cumsum([0, *(len(space.starts) for space in spaces)], dtype=np.int32),
            target_offsets=np.cumsum([0, *(len(space.targets) for space in spaces)], dtype=np.int32),
            origins=origins,
            ray_cos=np.cos(angles).astype(np.float32),
            ray_sin=np.sin(angles).astype(np.float32),
        )
        numbers = observation_size(task)
        self.robots = Robots(
            records=np.zeros(robots, dtype=ROBOT),
            poses=np.zeros((robots, 3), dtype=np.float32),
            targets=np.zeros((robots, 2), dtype=np.float32),
            ranges=np.zeros((robots, task.lidar.rays), dtype=np.float32),
            observations=np.zeros((robots, numbers), dtype=np.float32),
            final_observations=np.zeros((robots, numbers), dtype=np.float32),
            rewards=np.zeros(robots, dtype=np.float32),
            terms=np.zeros((robots, len(REWARD_TERMS)), dtype=np.float32),
            terminations=np.zeros(robots, dtype=np.bool_),
            truncations=np.zeros(robots, dtype=np.bool_),
            outcomes=np.zeros(robots, dtype=np.uint8),
        )
        self._parameters = pack_parameters(task)
        self._parameters["replica_stride"] = len(self.arenas)
        self.robots.records["replica"] = np.arange(robots) // (ROBOTS_PER_TILE * len(self.arenas))
        self._space = TiledSpace(self.arenas, origins, robots, task.robot.radius)
        self.seed(seed)

    def __len__(self) -> int:
        return len(self.robots.records)

    def seed(self, seed: int | None) -> None:
        """Start every robot's generator anew; None takes a seed from the operating system."""
        self.robots.records["random"] = seed_streams(seed, len(self))

    def reset(
        self, *, poses: ArrayLike | None = None, targets: ArrayLike | None = None, arenas: ArrayLike | None = None
    ) -> None:
        """Begin a new episode for every robot; what is not given is drawn.

        Args:
            poses: (N, 3) x, y, heading, or one pose for all.
            targets: (N, 2) x, y, or one target for all.
            arenas: (N,) indices into the pool for robots placed by `poses`; by default they stay where they are.

        Raises:
            PlacementError: a pose or target is not finite, or touches an obstacle or a wall.
        """
        n = len(self)
        maps = self.robots.records["map"] if arenas is None else np.broadcast_to(np.asarray(arenas, dtype=np.int32), (n,))
        if arenas is not None and ((maps < 0) | (maps >= len(self.arenas))).any():
            raise PlacementError(f"arenas must be between 0 and {len(self.arenas) - 1}")
        if targets is not None and poses is None and len(self.arenas) > 1:
            raise PlacementError("targets without poses make sense in a single arena only: give poses too")
        placed = self._placements("poses", poses, 3, maps, self.task.robot.radius)
        aimed = self._placements("targets", targets, 2, maps, 0.0)
        self.robots.records["map"] = maps
        self.robots.records["parked"] = 0
        reset_robots(placed, aimed, self.robots, self.geometry, self._parameters, self._space.state)

    def reset_with(self, options: Mapping[str, ArrayLike] | None) -> None:
        """`reset`, with its arguments as Gymnasium passes them.

        Raises:
            PlacementError: an option is not known, or `reset` refuses it.
        """
        options = options or {}
        if unknown := options.keys() - {"poses", "targets", "arenas"}:
            raise PlacementError(f"unknown reset options {sorted(unknown)}; known are poses, targets and arenas")
        self.reset(poses=options.get("poses"), targets=options.get("targets"), arenas=options.get("arenas"))

    def _placements(
        self, name: str, values: ArrayLike | None, columns: int, maps: NDArray[np.int32], clearance: float
    ) -> NDArray[np.float32]:
        """Requested poses or targets, (N, columns), checked; NaN where none is requested."""
        if values is None:
            return np.full((len(self), columns), np.nan, dtype=np.float32)
        try:
            array = np.broadcast_to(np.asarray(values, dtype=np.float32), (len(self), columns)).copy()
        except ValueError as error:
            raise PlacementError(f"{name} must have shape ({len(self)}, {columns})") from error
        if not np.isfinite(array).all():
            raise PlacementError(f"{name} must be finite")
        for index in np.unique(maps):
            here = np.flatnonzero(maps == index)
            bad = here[free_distance(self.arenas[index], array[here, :2]) <= clearance]
            if len(bad):
                raise PlacementError(
                    f"{name}[{bad[0]}] = {array[bad[0]].tolist()} touches an obstacle or a wall "
                    f"of arena {self.arenas[index].name!r}"
                )
        if columns == 3:
            beyond = np.abs(array[:, 2]) > np.pi
            array[beyond, 2] = np.arctan2(np.sin(array[beyond, 2]), np.cos(array[beyond, 2]))
        return array

    def step(self, actions: NDArray[np.float32]) -> None:
        """Drive every robot for one control period.

        Args:
            actions: (N, 2) float32, linear in [0, 1] and angular in [-1, 1] as fractions of the robot's limits; clipped.

        Raises:
            ValueError: an action is not finite.
        """
        space = self._space
        invalid = write_commands(actions, self.robots.records, space.state, space.command, self._parameters)
        if invalid >= 0:
            raise ValueError(f"the action of robot {invalid} is not finite: {actions[invalid].tolist()}")
        space.step(self.task.control_period)
        step_robots(space.state, self.robots, self.geometry, self._parameters)

    def park(self, which: NDArray[np.bool_] | NDArray[np.int64]) -> None:
        """Leave robots standing, at next to no cost, until the next `reset`; their outcomes stay 0."""
        self.robots.records["parked"][which] = 1

    def get_state(self) -> dict[str, NDArray[np.generic]]:
        """Everything that the future depends on, as plain arrays."""
        state = {name: self.robots.records[name].copy() for name in ROBOT.names or ()}
        state |= {name: array.copy() for name, array in self.robots._asdict().items() if name != "records"}
        state["bodies"] = self._space.state.copy()
        return state

    def set_state(self, state: Mapping[str, NDArray[np.generic]]) -> None:
        """Go on from what `get_state` gave, bit for bit.

        Raises:
            ValueError: the state is of another task or number of robots.
        """
        targets: dict[str, NDArray[np.generic]] = {name: self.robots.records[name] for name in ROBOT.names or ()}
        targets |= {name: array for name, array in self.robots._asdict().items() if name != "records"}
        targets["bodies"] = self._space.state
        if state.keys() != targets.keys():
            raise ValueError(f"not a state of this environment: {sorted(state.keys() ^ targets.keys())} do not match")
        for name, target in targets.items():
            if state[name].shape != target.shape:
                raise ValueError(
                    f"{name} has shape {state[name].shape}, not {target.shape}: another task or number of robots"
                )
        for name, target in targets.items():
            target[...] = state[name]
