"""Shortest paths for a reward: by hand round a wall, against the planner, and what a robot is paid on its way."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sim.arenas import Arena, build_arenas
from sim.arenas.planner import Planner
from sim.config import ArenaConfig, PathProgressTerm, RewardConfig, TaskConfig
from sim.engine.paths import Paths
from sim.engine.world import World, spawn_space
from sim.errors import ArenaError, PlacementError
from tests.sim.scenes import arenas

CLEARANCE = TaskConfig().passable_clearance
# 10 x 10 m with a wall from the lower edge up to y = 2, 0.2 m thick.
WALL = Arena("wall", circles=np.empty((0, 3)), boxes=np.array([[0.0, -1.5, 0.1, 3.5, 0.0]]))
REWARD = RewardConfig(terms=(PathProgressTerm(weight=10.0),))


def test_round_a_wall_by_hand() -> None:
    """From (-2, 0) to (2, 0) over the wall's end: its corners at (±0.1, 2), each 0.2 m away."""
    # Tight: to (-0.1, 2.2), 0.2 to the right, and down: 2 sqrt(1.9² + 2.2²) + 0.2 = 6.01. Whole cells of 0.1 m keep up to
    # 0.15 m more at each corner, a twentieth of this path.
    tight = 2.0 * math.hypot(1.9, 2.2) + 0.2
    assert pytest.approx(0.2) == CLEARANCE
    length = Paths([WALL], CLEARANCE).length(0, (-2.0, 0.0), (2.0, 0.0))
    assert tight < length < 1.06 * tight


def test_straight_where_the_target_is_in_sight() -> None:
    paths = Paths([WALL], CLEARANCE)
    assert paths.length(0, (-2.0, 0.0), (-3.0, 3.0)) == pytest.approx(math.hypot(1.0, 3.0))
    assert paths.length(0, (-2.0, 3.0), (2.0, 4.0)) == pytest.approx(math.hypot(4.0, 1.0))
    assert (paths.owners < 0).all()


@settings(max_examples=40, deadline=None)
@given(arenas, st.integers(0, 2**32 - 1))
def test_never_below_the_straight_line_and_near_the_planners(arena: Arena, seed: int) -> None:
    rng = np.random.default_rng(seed)
    try:
        space = spawn_space(TaskConfig(), arena)
    except ArenaError:
        assume(False)
    paths, planner = Paths([arena], CLEARANCE), Planner(arena, CLEARANCE)
    for _ in range(5):
        place, target = (rng.choice(space.targets).astype(float) + 0.05 for _ in range(2))
        length, straight = paths.length(0, place.tolist(), target.tolist()), math.dist(place, target)
        assert length >= straight - 1e-9
        try:
            planned = planner.shortest_path(place, target).length
        except PlacementError:
            continue
        # The planner cuts corners on the exact geometry and knows gaps that are closed to larger cells.
        assert length > planned - 0.02 or length == pytest.approx(straight)


def test_on_the_complex_arena_it_is_the_planners_within_a_fiftieth_on_average() -> None:
    arena = build_arenas(ArenaConfig(name="complex"))[0]
    paths, planner, rng = Paths([arena], CLEARANCE), Planner(arena, CLEARANCE), np.random.default_rng(0)
    targets = spawn_space(TaskConfig(), arena).targets.astype(float) + 0.05
    ratios = []
    for _ in range(100):
        place, target = rng.choice(targets), rng.choice(targets)
        ratios.append(paths.length(0, place.tolist(), target.tolist()) / planner.shortest_path(place, target).length)
    assert min(ratios) > 1.0 - 1e-6
    assert np.mean(ratios) < 1.03
    assert max(ratios) < 1.2


def test_less_clearance_sees_ways_that_whole_cells_miss() -> None:
    # A wall across the room with a gap from y = -0.21 to 0.31. The cell around (0, 0.05) keeps 0.26 m from both posts at its
    # middle, and is free as a whole where that is 0.1 m / sqrt(2) more than paths keep: for 0.17 m and not for 0.2.
    boxes = np.array([[0.0, -2.605, 0.02, 2.395, 0.0], [0.0, 2.155, 0.02, 1.845, 0.0]])
    gap = Arena("gap", circles=np.empty((0, 3)), boxes=boxes)
    ends = (-2.0, 0.05), (2.0, 0.05)
    assert Paths([gap], 0.2).length(0, *ends) > 8.0
    assert Paths([gap], 0.17).length(0, *ends) == pytest.approx(4.0, abs=0.1)


def test_a_reward_says_what_its_paths_keep_from_obstacles() -> None:
    assert TaskConfig(reward=REWARD).path_clearance == pytest.approx(CLEARANCE)
    nearer = RewardConfig(terms=(PathProgressTerm(clearance=0.17),))
    assert TaskConfig(reward=nearer).path_clearance == pytest.approx(0.17)
    assert TaskConfig(reward=nearer).passable_clearance == pytest.approx(CLEARANCE)


def test_where_no_path_leads_it_is_the_straight_line() -> None:
    closed = Arena("closed", circles=np.empty((0, 3)), boxes=np.array([[0.0, 0.0, 0.1, 5.0, 0.0]]))
    assert Paths([closed], CLEARANCE).length(0, (-2.0, 0.0), (2.0, 1.0)) == pytest.approx(math.hypot(4.0, 1.0))


def test_few_fields_are_kept_and_lengths_do_not_depend_on_which() -> None:
    all_kept, few = Paths([WALL, WALL], CLEARANCE), Paths([WALL, WALL], CLEARANCE, max_bytes=3 * 4 * 100 * 100)
    assert len(few.fields) == 3
    rng = np.random.default_rng(0)
    targets = rng.uniform((1.0, -4.0), (4.0, 0.0), (8, 2)).tolist()
    for index in rng.integers(0, 8, 60).tolist():
        given = index % 2, (-2.0, -1.0), targets[index]
        assert few.length(*given) == all_kept.length(*given)


def test_the_reward_pays_for_the_way_round_the_wall() -> None:
    """Up along the wall nothing is gained in the straight line; by the path it is nearly all that is driven."""
    world = World(TaskConfig(reward=REWARD), [WALL], 1, seed=0)
    world.reset(poses=[[-0.5, 0.0, math.pi / 2]], targets=[[2.0, 0.0]])
    before = Paths([WALL], CLEARANCE).length(0, (-0.5, 0.0), (2.0, 0.0))
    paid = 0.0
    for _ in range(20):
        world.step(np.array([[1.0, 0.0]], np.float32))
        paid += float(world.robots.rewards[0])
    x, y, _ = world.robots.poses[0].tolist()
    assert y == pytest.approx(20 * 0.2 * 0.25, abs=0.01)
    assert paid == pytest.approx(10.0 * (before - Paths([WALL], CLEARANCE).length(0, (x, y), (2.0, 0.0))), abs=1e-3)
    assert paid > 10.0 * 0.8 * y
    assert world.robots.terms[0, 0] == world.robots.rewards[0]


@pytest.mark.parametrize("restart", ["same step", "next step"])
def test_what_is_paid_in_an_attempt_adds_up_over_ends_of_episodes(restart: str) -> None:
    """Over arrivals, time-outs and collisions: never a jump, since a new way is measured from where it begins."""
    task = TaskConfig(arena=ArenaConfig(name="complex"), reward=REWARD, step_limit=12)
    world = World(task, build_arenas(task.arena), 32, seed=1, restart=restart)  # type: ignore[arg-type]
    world.reset()
    rng, ended = np.random.default_rng(0), 0
    for _ in range(60):
        world.step(rng.uniform((0.0, -1.0), (1.0, 1.0), (32, 2)).astype(np.float32))
        ended += int((world.robots.outcomes != 0).sum())
        # A step of 0.05 m changes a path by no more, and by one cell's rounding at a corner.
        assert np.abs(world.robots.rewards).max() < 10.0 * (0.05 + 0.25)
    assert ended > 50


def test_it_goes_on_from_a_state_bit_for_bit() -> None:
    task = TaskConfig(arena=ArenaConfig(name="complex"), reward=REWARD)
    world, other = (World(task, build_arenas(task.arena), 16, seed=seed) for seed in (1, 2))
    for one in (world, other):
        one.reset()
    actions = np.random.default_rng(0).uniform((0.0, -1.0), (1.0, 1.0), (40, 16, 2)).astype(np.float32)
    for action in actions[:20]:
        world.step(action)
    other.set_state(world.get_state())
    for action in actions[20:]:
        world.step(action)
        other.step(action)
        np.testing.assert_array_equal(world.robots.rewards, other.robots.rewards)
