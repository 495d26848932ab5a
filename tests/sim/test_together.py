"""Robots that see one another: what they meet, how they collide, where they start, and what nobody else notices."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from sim.arenas import Arena, build_task_arenas
from sim.arenas.mover import Mover
from sim.arrays import Floats
from sim.config import (
    ArenaConfig,
    GeneratedArenaConfig,
    JackalConfig,
    LidarConfig,
    MoversConfig,
    ObservationConfig,
    RoundConfig,
    TaskConfig,
)
from sim.engine.world import World
from sim.envs.vector import NavigationVectorEnv
from sim.errors import ArenaError, PlacementError
from sim.kernels.records import ARRIVAL, COLLISION
from sim.kernels.step import MOVER_ROOM
from sim.scan import scan
from sim.suites import Situation, load_suite, run_controller, suite_for

HALL = Arena("hall", 6.0, 6.0)
FULL = LidarConfig(rays=60, field_of_view=360.0)
CLUTTER = GeneratedArenaConfig(name="clutter", difficulty=0.3, maps=4, seed=1)
BURGER = TaskConfig().robot.circumscribed_radius
STAND = np.zeros((2, 2), np.float32)
ON = np.array([[1.0, 0.0], [1.0, 0.0]], np.float32)


def task(together: int = 2, **values: object) -> TaskConfig:
    return TaskConfig.model_validate({"together": together, "lidar": FULL, **values})


def pair(poses: list[list[float]], **values: object) -> World:
    world = World(task(2, **values), (HALL,), 2, seed=0)
    world.reset(poses=poses, targets=[[5.0, 5.0], [5.0, -5.0]], arenas=[0, 0])
    return world


def others(world: World, index: int) -> list[list[float]]:
    together = world.task.together
    first = index // together * together
    radius = world.task.robot.circumscribed_radius
    return [[*world.robots.poses[j, :2], radius] for j in range(first, first + together) if j != index]


def random_actions(seed: int, steps: int, robots: int) -> Floats:
    return np.random.default_rng(seed).uniform(-0.2, 1.0, (steps, robots, 2)).astype(np.float32)


def test_a_robot_sees_the_surface_of_the_one_ahead() -> None:
    observation = ObservationConfig.preset("improved", batches=3)
    world = pair([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]], lidar=LidarConfig(rays=3), observation=observation)
    assert world.robots.ranges[0] == pytest.approx([3.5, 2.0 - BURGER, 3.5])
    # The other one looks away.
    assert world.robots.ranges[1] == pytest.approx([3.5, 3.5, 3.5])


def test_it_sees_where_the_other_has_come_to_in_the_same_step() -> None:
    world = pair([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    world.step(np.array([[0.0, 0.0], [1.0, 0.0]], np.float32))
    driven = world.robots.poses[1, 0] - 2.0
    assert driven > 0.04
    assert world.robots.ranges[0].min() == pytest.approx(2.0 + driven - BURGER, abs=1e-6)


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 8))
def test_scans_are_those_of_an_arena_in_which_the_others_are_discs(seed: int, together: int) -> None:
    envs = NavigationVectorEnv(task(together, arena=CLUTTER), 4 * together, seed=seed)
    envs.reset()
    world = envs._world
    for action in random_actions(seed, 20, 4 * together):
        envs.step(action)
        if world.robots.terminations.any():
            continue  # who begins anew stands elsewhere than when the others looked
        for index in range(len(world)):
            arena = world.arenas[world.robots.records["map"][index]]
            seen = scan(arena, world.robots.poses[index], FULL, movers=others(world, index))
            # A ray that grazes a disc may miss it by a rounding.
            assert (np.abs(seen - world.robots.ranges[index]) > 1e-3).sum() <= 1


def test_two_that_meet_head_on_collide_in_the_same_step() -> None:
    world = pair([[0.0, 0.0, 0.0], [0.8, 0.0, np.pi]], collision_distance=0.0)
    for _ in range(30):
        world.step(ON)
        if world.robots.outcomes.any():
            break
    assert world.robots.outcomes.tolist() == [COLLISION, COLLISION]


def test_two_fast_ones_do_not_pass_through_each_other_between_two_moments() -> None:
    robot = RoundConfig(radius=0.1, max_linear_speed=2.0)
    world = pair([[0.0, 0.0, 0.0], [0.6, 0.0, np.pi]], robot=robot, collision_distance=0.0, control_period=0.5)
    world.step(ON)  # each comes a metre: side by side before, side by side after
    assert world.robots.outcomes.tolist() == [COLLISION, COLLISION]


def test_rectangular_ones_collide_too() -> None:
    world = pair([[0.0, 0.0, 0.0], [1.5, 0.0, np.pi]], robot=JackalConfig(), collision_distance=0.0)
    steps = 0
    while not world.robots.outcomes.any():
        world.step(ON)
        steps += 1
        assert steps < 30
    assert world.robots.outcomes.tolist() == [COLLISION, COLLISION]


def test_who_drives_alone_and_groups_beside_one_another_notice_nothing() -> None:
    poses = [[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, np.pi], [1.0, 2.0, np.pi]]
    world = World(task(2), (HALL,), 4, seed=0)
    world.reset(poses=poses, targets=[[5.0, 5.0]] * 4, arenas=[0] * 4)
    # The first two are two metres apart and have each other; the third stands before the first and is of another group.
    assert world.robots.ranges[0].min() == pytest.approx(2.0 - BURGER, abs=1e-4)
    alone = World(task(1), (HALL,), 4, seed=0)
    alone.reset(poses=poses, targets=[[5.0, 5.0]] * 4, arenas=[0] * 4)
    assert alone.movers.discs.shape[1] == 0
    assert alone.robots.ranges[0].min() == pytest.approx(3.5)


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_whoever_begins_anew_is_clear_of_the_others(mode: str) -> None:
    envs = NavigationVectorEnv(task(8, arena=ArenaConfig(name="simple")), 64, seed=3, autoreset_mode=mode)
    envs.reset()
    world = envs._world
    fresh, begun = np.ones(64, np.bool_), 0
    straight_on = np.tile(np.array([1.0, 0.0], np.float32), (64, 1))
    for _ in range(400):
        for index in np.flatnonzero(fresh).tolist():
            gaps = [np.hypot(*(world.robots.poses[index, :2] - other[:2])) - other[2] for other in others(world, index)]
            assert min(gaps) > MOVER_ROOM - 1e-4
        begun += int(fresh.sum())
        ended = world.robots.terminations.copy()
        _, _, terminations, *_ = envs.step(straight_on)
        fresh = ended if mode == "NextStep" else terminations
    assert begun > 200


def test_a_group_stays_in_its_arena_and_no_arena_stands_empty() -> None:
    envs = NavigationVectorEnv(task(4, arena=CLUTTER), 8, seed=1)
    envs.reset()
    assert len(envs.arenas) == 2
    assert envs.arena_indices.tolist() == [0] * 4 + [1] * 4
    for action in random_actions(2, 300, 8):
        envs.step(action)
    assert envs.arena_indices.tolist() == [0] * 4 + [1] * 4
    assert envs.places().tolist() == [envs.tiles()[0]] * 4 + [envs.tiles()[4]] * 4


def test_movers_go_the_same_way_in_every_copy() -> None:
    arena = ArenaConfig(name="simple", movers=MoversConfig(count=3))
    envs = NavigationVectorEnv(task(2, arena=arena), 6, seed=1)
    envs.reset()
    for action in random_actions(2, 50, 6):
        envs.step(action)
    assert envs.discs.shape[1:] == (3, 5)
    assert (envs.discs == envs.discs[:1]).all()
    assert envs._world.movers.discs.shape[1] == 4


def test_a_state_goes_on_bit_for_bit() -> None:
    envs, other = (NavigationVectorEnv(task(4, arena=CLUTTER), 16, seed=seed) for seed in (7, 8))
    envs.reset()
    actions = random_actions(1, 120, 16)
    for action in actions[:60]:
        envs.step(action)
    other.reset()
    other.set_state(envs.get_state())
    for action in actions[60:]:
        for ours, theirs in zip(envs.step(action)[:4], other.step(action)[:4], strict=True):
            assert np.array_equal(ours, theirs)


def test_a_group_needs_one_arena() -> None:
    world = World(task(2), (HALL, HALL), 4, seed=0)
    with pytest.raises(PlacementError, match="2 one after another"):
        world.reset(poses=[[0.0, 0.0, 0.0]] * 4, arenas=[0, 1, 1, 1])


def test_people_give_way_to_one_robot_not_to_several() -> None:
    with pytest.raises(ValidationError, match="together must be 1"):
        task(2, arena=ArenaConfig(movers=MoversConfig(count=1, sees_robots=True)))
    polite = Arena("polite", movers=(Mover("pedestrian", 0.25, 1.0, sees_robots=True),))
    with pytest.raises(ArenaError, match="not to several"):
        World(task(2), (polite,), 2, seed=0)


def towards_target(situation: Situation) -> Floats:
    """Turn to the target, then go: whatever stands in the way."""
    dx, dy = (situation.targets - situation.poses[:, :2]).T
    bearing = np.arctan2(dy, dx) - situation.poses[:, 2]
    bearing = np.arctan2(np.sin(bearing), np.cos(bearing))
    return np.stack([np.abs(bearing) < 0.2, np.clip(bearing, -1.0, 1.0)], axis=1).astype(np.float32)


def test_their_own_suite_has_whole_groups_and_a_frozen_one_has_each_alone() -> None:
    together = task(3, arena=ArenaConfig(name="simple"), lidar=LidarConfig())
    suite = suite_for(together)
    assert (suite.name, suite.together, len(suite)) == ("simple-3-together-201", 3, 201)
    starts = suite.starts[:, :2].reshape(-1, 3, 2)
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert np.hypot(*(starts[:, a] - starts[:, b]).T).min() > MOVER_ROOM
    met = run_controller(towards_target, together, suite)
    alone = run_controller(towards_target, together, load_suite("simple-200"))
    # In the empty arena only the others are in the way.
    assert (alone.outcomes == ARRIVAL).mean() > 0.99
    assert (met.outcomes == COLLISION).mean() > 0.05


def test_who_has_arrived_is_gone() -> None:
    world = World(task(2), (HALL,), 2, seed=0, respawn=False)
    world.reset(poses=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], targets=[[5.0, 5.0], [5.0, -5.0]], arenas=[0, 0])
    world.park(np.array([1]))
    world.step(STAND)
    assert world.robots.ranges[0].min() == pytest.approx(3.5)


def test_drawn_arenas_are_those_of_the_groups() -> None:
    made = World(task(4, arena=CLUTTER), build_task_arenas(task(4, arena=CLUTTER)), 64, seed=0)
    made.reset()
    # Four maps, sixteen groups: four groups of four robots in each, a copy for every robot.
    assert np.bincount(made.robots.records["map"]).tolist() == [16] * 4
    assert len(np.unique(made.tiles())) == 64
