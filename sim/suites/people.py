"""What a robot does to the people around it: collisions and whose they are, intrusions, and how people are held up."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.arrays import Floats
from sim.config import TaskConfig
from sim.engine.world import World
from sim.suites.driving import EpisodeTable, Situation, run_controller
from sim.suites.scenarios import scenario_world
from sim.suites.suite import Suite

Doubles = NDArray[np.float64]

INTIMATE = 0.45
"""Metres between bodies within which a robot intrudes: the intimate distance of Hall, "The Hidden Dimension", 1966."""

_COLLISION = 2
_CONTACT = 0.02  # m between bodies at the end of a step in which they touched on the way
_CLOSING = 1e-3  # m by which a robot's own step closes a gap


@dataclass(frozen=True, eq=False)
class PeopleTable:
    """What happened to the people in each of S scenarios, in the suite's order.

    Attributes:
        episodes: what the robot did.
        at_fault: (S,) a collision that is the robot's: with an obstacle, or with a person as its own motion closed the gap.
        intrusion: (S,) seconds during which the robot was within `INTIMATE` of somebody.
        delay: (S,) seconds by which people were behind, at the end of the attempt, of where they would have been on their
            routes without a robot, summed over the people of the scenario; below 0 where they are ahead.
        detour: (S,) metres walked per metre of their routes, over all people of the scenario, less the same without a robot.
    """

    episodes: EpisodeTable
    at_fault: NDArray[np.bool_]
    intrusion: Doubles
    delay: Doubles
    detour: Doubles


def body_gaps(poses: Doubles, discs: Doubles, task: TaskConfig) -> Doubles:
    """Signed distances (n, K) from robots' bodies at poses (n, 3) to discs (n, K, 3) x, y, radius, metres.

    A round body has what counts as a collision around it, `TaskConfig.collision_distance`; an empty slot is infinitely far.
    """
    dx, dy = discs[..., 0] - poses[:, :1], discs[..., 1] - poses[:, 1:2]
    if task.robot.half_extents is None:
        gaps = np.hypot(dx, dy) - max(task.robot.inscribed_radius, task.collision_distance)
    else:
        half_length, half_width = task.robot.half_extents
        cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
        beyond, beside = np.abs(cos * dx + sin * dy) - half_length, np.abs(cos * dy - sin * dx) - half_width
        gaps = np.hypot(np.maximum(beyond, 0.0), np.maximum(beside, 0.0)) + np.minimum(np.maximum(beyond, beside), 0.0)
    return np.asarray(np.where(discs[..., 2] > 0.0, gaps - discs[..., 2], np.inf))


def robots_fault(before: Doubles, after: Doubles, discs: Doubles, task: TaskConfig) -> NDArray[np.bool_]:
    """Whether collisions are the robots' own.

    A robot that comes nearer to the person by its own motion, the person standing where it was, is at fault; one that
    stands, or drives away, is not. What touches nobody has met an obstacle.

    Args:
        before: (n, 3) poses of the robots before the step in which they collided.
        after: (n, 3) and after it.
        discs: (n, K, 5) people as they are after it, see `sim.kernels.records.DISC_COLUMNS`.
        task: robot and collision distance.
    """
    earlier = discs[..., :3].copy()
    earlier[..., :2] -= discs[..., 3:5]
    now = body_gaps(after, discs[..., :3], task)
    nearest = np.argmin(np.minimum(now, body_gaps(after, earlier, task)), axis=1)
    rows = np.arange(len(after))
    touched = np.minimum(now, body_gaps(after, earlier, task))[rows, nearest] < _CONTACT
    closed = body_gaps(before, earlier, task)[rows, nearest] - body_gaps(after, earlier, task)[rows, nearest]
    return np.asarray(~touched | (closed > _CLOSING))


class _Walks:
    """How far the people of every scenario have come: along their routes, and on their feet; (S, K) metres each."""

    def __init__(self, world: World, tiles: NDArray[np.int32]) -> None:
        self._tiles = tiles
        self.places = world.movers.discs[tiles, :, :2].astype(np.float64)
        self.walked = np.zeros(self.places.shape[:2])
        self._left, self._corner = world.movers.routes_left(tiles)
        self.progress = np.zeros(self.places.shape[:2])

    def follow(self, world: World) -> None:
        """Take in one step."""
        places = world.movers.discs[self._tiles, :, :2].astype(np.float64)
        self.walked += np.hypot(*np.moveaxis(places - self.places, -1, 0))
        left, corner = world.movers.routes_left(self._tiles)
        self.progress += np.where(corner == self._corner, self._left - left, 0.0)
        self.places, self._left, self._corner = places, left, corner


def run_among_people(controller: Callable[[Situation], Floats], task: TaskConfig, suite: Suite) -> PeopleTable:
    """Drive every scenario once, and again without a robot: who is held up, and who is hit.

    Args:
        controller: as that of `run_controller`.
        task: as there.
        suite: whose people walk along routes; `delay` and `detour` say nothing of others.

    Raises:
        SuiteError: as `run_controller` does.
    """
    count = len(suite)
    at_fault = np.zeros(count, dtype=np.bool_)
    intrusion, delay, detour = np.zeros((3, count))
    before = np.zeros((count, 3))
    walks: list[_Walks] = []
    alone = scenario_world(task.model_copy(update={"together": suite.together}), suite.arenas, count)
    alone.reset(poses=suite.starts, targets=suite.targets, arenas=suite.arena_indices)
    alone.park(np.arange(count))
    standing = np.zeros((count, 2), dtype=np.float32)

    def watch(active: NDArray[np.int64], world: World, _actions: Floats) -> None:
        tiles = world.tiles()
        if not walks:
            walks.extend((_Walks(world, tiles), _Walks(alone, tiles)))
        else:
            alone.step(standing)
            walks[0].follow(world)
            walks[1].follow(alone)
        discs = world.movers.discs[tiles[active]].astype(np.float64)
        poses = world.robots.poses[active].astype(np.float64)
        near = body_gaps(poses, discs[..., :3], task).min(axis=1, initial=np.inf) < INTIMATE
        intrusion[active] += task.control_period * near
        outcomes = world.robots.outcomes[active]
        hit = outcomes == _COLLISION
        at_fault[active[hit]] = robots_fault(before[active[hit]], poses[hit], discs[hit], task)
        before[active] = poses
        done = active[outcomes > 0]
        if len(done):
            here, free = walks
            speeds = np.maximum(world.movers.speeds(tiles[done]), 1e-9)
            delay[done] = ((free.progress[done] - here.progress[done]) / speeds).sum(axis=1)
            detour[done] = _per_metre(here, done) - _per_metre(free, done)

    episodes = run_controller(controller, task, suite, watch)
    return PeopleTable(episodes, at_fault, intrusion, delay, detour)


def _per_metre(walks: _Walks, which: NDArray[np.int64]) -> Doubles:
    """Metres walked for a metre of the routes, (n,); 1 where nobody came anywhere."""
    walked, progress = walks.walked[which].sum(axis=1), walks.progress[which].sum(axis=1)
    return np.asarray(np.where(progress > 0.5, walked / np.maximum(progress, 0.5), 1.0))
