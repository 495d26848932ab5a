"""What a policy is about to do from here, and what it would do elsewhere, found by driving copies of the world."""

import math
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sim.actions import action_layout, fastest_way, twists
from sim.arenas import Arena, free_distance
from sim.arrays import PolicyFunction
from sim.config import LidarConfig, TaskConfig
from sim.drivers import Driver
from sim.engine.world import World
from workers.live.showcase import along_arc
from workers.play_protocol import MAX_ARROWS, MAX_VALUES, MAX_WAY_POINTS, Place, PlaySeen

Arrow = tuple[float, float, float, float]
"""x, y of a place, and of where it would go from there; metres."""

AHEAD_SECONDS = 30.0
"""Simulated time that is looked ahead."""

_OUTCOMES: tuple[Literal["arrival", "collision", "timeout"], ...] = ("arrival", "collision", "timeout")
# Metres between two arrows where there is room for so many.
_SPACING = 0.5
_ARROW = 0.8
_DECIMALS = 3


def copy_of(world: World, task: TaskConfig | None = None, arena: Arena | None = None) -> World:
    """A world of the same robots and movers at the same moment.

    Args:
        world: of one arena.
        task: with other disturbances; its own where not given.
        arena: with as many movers; its own where not given.

    Raises:
        ArenaError: the robot does not fit into the arena.
    """
    copy = World(task or world.task, (arena or world.arenas[0],), len(world))
    copy.reset()
    state, now = copy.get_state(), world.get_state()
    copy.set_state({name: now[name] if name in now and now[name].shape == new.shape else new for name, new in state.items()})
    return copy


def foresee(world: World, driver: Driver, gamma: float) -> PlaySeen:
    """Drives a copy ahead until the robot's attempt ends, or for `AHEAD_SECONDS`.

    Where nobody changes anything, this is what comes: the copy has the same random numbers ahead of it.

    Args:
        world: of one robot; stays as it is.
        driver: who drives it; stays as it is.
        gamma: discount of a step.
    """
    ahead, drives = copy_of(world), driver.copy()
    lows, period = np.array(action_layout(world.task.robot).lows, np.float32), world.task.control_period
    limit = max(1, round(AHEAD_SECONDS / period))
    rewards, ended = list[float](), 0
    way = [ahead.robots.poses[0, :2].tolist()]
    for _ in range(limit):
        ahead.step(np.clip(drives(ahead.robots.observations), lows, 1.0).astype(np.float32))
        rewards.append(float(ahead.robots.rewards[0]))
        ended = int(ahead.robots.outcomes[0])
        # After a collision or a time-out it stands at another start already.
        if ended < 2:
            way.append(ahead.robots.poses[0, :2].tolist())
        if ended:
            break
    values = [0.0]
    for reward in reversed(rewards):
        values.append(reward + gamma * values[-1])
    values.reverse()
    return PlaySeen(
        value=values[0],
        values=tuple(values[:MAX_VALUES]),
        outcome=_OUTCOMES[ended - 1] if ended else None,
        seconds=round(len(rewards) * period, _DECIMALS),
        way=_thinned(way),
    )


def field(world: World, policy: PolicyFunction) -> tuple[Arrow, ...]:
    """What the policy would do all over the free space: where it would go from rest, facing the robot's target.

    Whatever moves is taken to stand. A policy that remembers is asked as at the beginning of an episode.

    Args:
        world: of one robot.
        policy: who drives.

    Returns:
        Up to `MAX_ARROWS`, the longest as long as most of the way to the next.
    """
    task, arena = _undisturbed(world.task), world.arenas[0]
    standing = world.movers.of(0).astype(np.float64) if len(world.movers) else np.empty((0, 3))
    arena = replace(arena, circles=np.vstack([arena.circles, standing]), movers=())
    places, spacing = _grid(arena, task.passable_clearance)
    if not len(places):
        return ()
    target = world.robots.targets[0]
    headings = np.arctan2(target[1] - places[:, 1], target[0] - places[:, 0])
    poses = np.column_stack([places, headings]).astype(np.float32)
    there = World(task, (arena,), len(poses), respawn=False)
    there.reset(poses=poses, targets=target)
    actions = np.clip(policy(there.robots.observations), np.array(action_layout(task.robot).lows, np.float32), 1.0)
    ends = along_arc(poses, twists(task.robot, actions).astype(np.float32), 1.0)
    length = _ARROW * spacing / fastest_way(task.robot, task.robot.max_linear_speed, task.robot.max_angular_speed)
    tips = places + length * (ends[:, :2] - places)
    rows = np.round(np.column_stack([places, tips]), _DECIMALS).tolist()
    return tuple((x, y, to_x, to_y) for x, y, to_x, to_y in rows)


def _undisturbed(task: TaskConfig) -> TaskConfig:
    """What the policy would do where it sees all there is."""
    lidar = LidarConfig.model_validate({**task.lidar.model_dump(), "noise": 0.0, "dropout": 0.0})
    return task.model_copy(update={"lidar": lidar})


def _grid(arena: Arena, clearance: float) -> tuple[NDArray[np.float64], float]:
    """Free places (n, 2) on a square grid, and the metres between two of them."""
    spacing = max(_SPACING, math.sqrt(4.0 * arena.half_width * arena.half_height / MAX_ARROWS) * 1.05)
    axes = [
        np.arange(-half + spacing / 2.0, half, spacing) + (2.0 * half % spacing) / 2.0
        for half in (arena.half_width, arena.half_height)
    ]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    return points[free_distance(arena, points) > clearance + 0.01][:MAX_ARROWS], spacing


def _thinned(way: list[list[float]]) -> tuple[Place, ...]:
    """Points of a line, evenly fewer where they are too many, with its end."""
    every = max(1, math.ceil(len(way) / (MAX_WAY_POINTS - 1)))
    kept = [*way[::every], way[-1]]
    return tuple((round(x, _DECIMALS), round(y, _DECIMALS)) for x, y in kept)
