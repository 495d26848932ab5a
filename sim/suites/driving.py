"""Driving all scenarios of a suite side by side, by a policy or by a controller that knows more than a policy sees."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.actions import action_layout
from sim.arrays import Floats, PolicyFunction
from sim.config import TaskConfig
from sim.drivers import Driver
from sim.engine.world import World
from sim.errors import PlacementError, SuiteError
from sim.kernels.records import TIMEOUT
from sim.suites.scenarios import scenario_world
from sim.suites.suite import Suite

Observer = Callable[[NDArray[np.int64], World, Floats], None]
"""Told before the first step, and after each one, the scenarios that were under way, the world as it is now, and the actions
(S, A) that were asked for in that step, zeros before the first one."""


@dataclass(frozen=True, eq=False)
class EpisodeTable:
    """What a policy did in each of S scenarios, in the suite's order.

    Attributes:
        outcomes: (S,) 1 arrival, 2 collision, 3 time-out.
        steps: (S,) control steps driven.
        rewards: (S,) summed.
        path_lengths: (S,) metres driven.
        shortest_paths: (S,) metres, the suite's.
        min_clearances: (S,) smallest distance of the body from anything else, metres.
    """

    outcomes: NDArray[np.uint8]
    steps: NDArray[np.int32]
    rewards: NDArray[np.float64]
    path_lengths: NDArray[np.float64]
    shortest_paths: NDArray[np.float64]
    min_clearances: Floats


@dataclass(frozen=True, eq=False)
class Situation:
    """The robots that are still under way, for controllers that know more than an observation says.

    Attributes:
        observations: (n, numbers).
        ranges: (n, rays) metres.
        poses: (n, 3) x, y, heading.
        targets: (n, 2).
        robots: (n,) which scenario each of them drives, for controllers that remember.
        velocities: (n, 2) of the last step, m/s and rad/s.
        discs: (n, K, 5) what moves around each, other robots too, see `sim.kernels.records.DISC_COLUMNS`: for controllers
            that are told.
    """

    observations: Floats
    ranges: Floats
    poses: Floats
    targets: Floats
    robots: NDArray[np.int64]
    velocities: Floats
    discs: Floats


def run_suite(policy: PolicyFunction, task: TaskConfig, suite: Suite, observer: Observer | None = None) -> EpisodeTable:
    """Drive every scenario once with a policy that sees observations; see `run_controller`."""
    driver = Driver(policy, len(suite))
    return run_controller(lambda situation: driver(situation.observations, situation.robots), task, suite, observer)


def run_controller(
    controller: Callable[[Situation], Floats], task: TaskConfig, suite: Suite, observer: Observer | None = None
) -> EpisodeTable:
    """Drive every scenario once, all side by side.

    Args:
        controller: situations of the robots under way to their actions (n, A); called with fewer robots as they finish.
        task: robot, LiDAR, observation, reward and limits; the arenas, and who is together, are the suite's.
        suite: the scenarios.
        observer: looks on.

    Raises:
        SuiteError: the task's robot does not fit at a start of the suite, or the suite's rules ask for another.
    """
    suite.rules.check(suite.name, task)
    limits = suite.rules.step_limits(task, suite.shortest_paths)
    task = task.model_copy(update={"step_limit": int(limits.max()), "together": suite.together})
    world = scenario_world(task, suite.arenas, len(suite))
    try:
        world.reset(poses=suite.starts, targets=suite.targets, arenas=suite.arena_indices)
    except PlacementError as error:
        raise SuiteError(
            f"suite {suite.name!r} has no room for this robot ({error}): use a smaller one, or the suite that "
            "sim.suites.suite_for draws for it"
        ) from error
    robots = world.robots
    outcomes = np.zeros(len(suite), dtype=np.uint8)
    actions = np.zeros((len(suite), action_layout(task.robot).size), dtype=np.float32)
    ended = {name: robots.records[name].copy() for name in ("steps", "attempt_reward", "path_length", "min_clearance")}
    active = np.arange(len(suite))
    tiles = world.tiles()
    if observer is not None:
        observer(active, world, actions)
    while len(active):
        situation = Situation(
            observations=robots.observations[active],
            ranges=robots.ranges[active],
            poses=robots.poses[active],
            targets=robots.targets[active],
            robots=active,
            velocities=world.velocities(active),
            discs=world.movers.discs[tiles[active]],
        )
        actions[active] = controller(situation)
        world.step(actions)
        late = active[(robots.outcomes[active] == 0) & (robots.records["steps"][active] >= limits[active])]
        robots.outcomes[late] = TIMEOUT
        if observer is not None:
            observer(active, world, actions)
        done = active[robots.outcomes[active] > 0]
        if len(done):
            outcomes[done] = robots.outcomes[done]
            for name, column in ended.items():
                column[done] = robots.records[name][done]
            world.park(done)
            active = active[robots.outcomes[active] == 0]
    return EpisodeTable(
        outcomes=outcomes,
        steps=ended["steps"],
        rewards=ended["attempt_reward"],
        path_lengths=ended["path_length"],
        shortest_paths=suite.shortest_paths,
        min_clearances=ended["min_clearance"],
    )
