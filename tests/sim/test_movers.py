"""What moves: that it keeps to walls, to speeds and off one another, and that robots meet it as pymunk would have it."""

import dataclasses

import numpy as np
import pymunk
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.arenas import Arena, Mover, build_arenas, free_distance
from sim.baselines.simple import go_to_goal
from sim.config import (
    ArenaConfig,
    JackalConfig,
    LidarConfig,
    MoverKind,
    MoversConfig,
    ObservationConfig,
    RandomisationConfig,
    TaskConfig,
)
from sim.engine.movers import Movers
from sim.engine.physics import add_arena, robot_body, tile_origins
from sim.engine.shapes import hulls, pack_shapes
from sim.engine.world import World
from sim.envs.vector import NavigationVectorEnv
from sim.errors import ArenaError
from sim.kernels.avoidance import choose_velocity, free_part
from sim.kernels.records import MAX_LINEAR
from sim.kernels.surroundings import free_length, obstacle_lines
from sim.streams import ENVIRONMENT
from sim.suites import load_suite
from sim.suites.scenarios import draw_scenarios, scenario_world
from tests.sim.scenes import random_arena
from tests.sim.test_sensing import TOLERANCE, chipmunk_scan, grazing
from tests.sim.test_vector_env import drive, random_actions

KINDS: tuple[MoverKind, ...] = ("patrol", "walker", "pedestrian")
CROWD = TaskConfig(arena=ArenaConfig(name="complex", movers=MoversConfig(count=6, speed=1.5)))

ROUNDING = 1e-5
"""Metres by which movers may seem to touch: positions are handed on in float32."""


def crowded_arena(seed: int) -> Arena:
    rng = np.random.default_rng(seed)
    movers = tuple(
        Mover(KINDS[rng.integers(3)], float(rng.uniform(0.1, 0.5)), float(rng.uniform(0.05, 1.5)))
        for _ in range(rng.integers(1, 17))
    )
    return dataclasses.replace(random_arena(seed), movers=movers)


def alone(arena: Arena, *, seed: int = 0, period: float = 0.2) -> Movers:
    """Movers without a world around them."""
    movers = Movers((arena,), pack_shapes((arena,)), tile_origins((arena,), 1), period, alike=False)
    movers.seed(seed, ENVIRONMENT)
    movers.place()
    return movers


def ways(movers: Movers, steps: int) -> np.ndarray:
    """(steps + 1, K, 2) where the movers of the first tile are after every step."""
    command = np.zeros((len(movers), 3))
    places = [movers.discs[0, :, :2].copy()]
    for _ in range(steps):
        movers.step(command, 0)
        places.append(movers.discs[0, :, :2].copy())
    return np.array(places, dtype=np.float64)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.05, 0.2, 1.0]))
def test_nobody_goes_through_walls_or_others_or_too_fast(seed: int, period: float) -> None:
    arena = crowded_arena(seed)
    movers = alone(arena, seed=seed, period=period)
    present = movers.discs[0, :, 2] > 0.0
    places = ways(movers, 150)[:, present]
    radii = np.array([mover.radius for mover in arena.movers])[present]
    speeds = np.array([mover.speed for mover in arena.movers])[present]
    moved = np.diff(places, axis=0)
    assert (np.hypot(*np.moveaxis(moved, -1, 0)) <= speeds * period + ROUNDING).all()
    for part in (0.0, 0.25, 0.5, 0.75):
        between = places[:-1] + part * moved
        assert (free_distance(arena, between) >= radii - ROUNDING).all()
        apart = np.hypot(*np.moveaxis(between[:, :, None] - between[:, None], -1, 0))
        apart[:, np.eye(len(radii), dtype=bool)] = np.inf
        assert (apart >= radii[:, None] + radii - ROUNDING).all()


@pytest.mark.parametrize("kind", KINDS)
def test_they_keep_going(kind: MoverKind) -> None:
    arena = dataclasses.replace(build_arenas(ArenaConfig(name="complex"))[0], movers=(Mover(kind, 0.25, 1.0),) * 6)
    places = ways(alone(arena), 600)
    driven = np.hypot(*np.moveaxis(np.diff(places, axis=0), -1, 0)).sum(axis=0)
    assert (driven > 0.4 * 120.0).all()  # metres, of 120 at top speed
    if kind != "patrol":
        assert (np.ptp(places, axis=0) > 4.0).all()


def test_a_patrol_keeps_to_its_round() -> None:
    corners = ((-2.0, -1.0), (2.0, -1.0), (2.0, 1.0), (-2.0, 1.0))
    places = ways(alone(Arena("round", movers=(Mover("patrol", 0.3, 1.2, corners),))), 200)[:, 0]
    on_round = np.minimum(np.abs(np.abs(places[:, 0]) - 2.0), np.abs(np.abs(places[:, 1]) - 1.0))
    assert on_round.max() < ROUNDING
    for corner in corners:
        assert np.hypot(*(places - corner).T).min() < ROUNDING


def test_two_patrols_on_one_line_turn_back_when_they_meet() -> None:
    line = ((-3.0, 0.0), (3.0, 0.0))
    places = ways(alone(Arena("line", movers=(Mover("patrol", 0.3, 1.0, line),) * 2)), 300)[:, :, 0]
    gap = np.abs(places[:, 0] - places[:, 1])
    assert 0.6 <= gap.min() < 0.7
    assert gap.max() > 1.0
    assert np.abs(np.diff(places, axis=0)).sum(axis=0).min() > 30.0  # metres, of 60 at top speed


def test_pedestrians_walk_round_one_another() -> None:
    # In an empty hall nobody should ever have to stop for long.
    places = ways(alone(Arena("hall", movers=(Mover("pedestrian", 0.25, 1.0),) * 8)), 500)
    speed = np.hypot(*np.moveaxis(np.diff(places, axis=0), -1, 0)) / 0.2
    assert speed.mean() > 0.75


def test_a_mover_without_room_stays_out() -> None:
    movers = alone(Arena("cell", 0.6, 0.6, movers=(Mover("pedestrian", 0.5, 1.0),) * 2))
    assert (movers.discs[0, :, 2] > 0.0).tolist() == [True, False]
    world = World(TaskConfig(), (Arena("full", movers=(Mover("walker", 0.5, 1.0),) * 16),), 1, seed=0)
    world.reset()
    assert np.isfinite(world.robots.observations).all()


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_rays_and_collisions_are_those_of_chipmunk(seed: int) -> None:
    arena = crowded_arena(seed)
    # The last of these scanners says that it sees all round, and looks ahead only.
    field, drawn = ((180.0, ()), (360.0, ()), (360.0, (120.0, 180.0)))[seed % 3]
    task = TaskConfig(
        collision_distance=0.0,
        lidar=LidarConfig(field_of_view=field),
        randomisation=RandomisationConfig(field_of_view=drawn),
        step_limit=10_000,
    )
    try:
        world = World(task, (arena,), 20, seed=seed)
    except ArenaError:
        return  # no room for a robot
    world.reset()
    robots, radius = world.robots, task.robot.inscribed_radius
    for action in random_actions(seed, 12, 20):
        before = robots.poses.astype(np.float64)
        world.step(action)
        discs = world.movers.discs[0][world.movers.discs[0, :, 2] > 0.0].astype(np.float64)
        # The bodies in the Space are where the LiDAR sees them.
        bodies = np.array([body.position for body in list(world._space.space.bodies)[20:]])
        assert bodies[world.movers.discs[0, :, 2] > 0.0] == pytest.approx(discs[:, :2], abs=ROUNDING)
        now = dataclasses.replace(arena, circles=np.vstack([arena.circles, discs[:, :3]]), movers=())
        going = robots.outcomes == 0
        poses = robots.poses[going].astype(np.float64)
        fields = world.fields_of_view[going]
        suspects = np.abs(robots.ranges[going] - chipmunk_scan(now, poses, task.lidar, fields)) > TOLERANCE
        assert not suspects.any() or not (suspects & ~grazing(now, poses, task.lidar, fields)).any()
        # In one step a robot comes 0.05 m far, and a mover 0.3 m: both are looked at on their way.
        nearest = np.full(20, np.inf)
        for part in np.linspace(0.0, 1.0, 26):
            space = pymunk.Space()
            add_arena(space, arena, 0.0, 0.0)
            for x, y, size, dx, dy in discs.tolist():
                space.add(pymunk.Circle(space.static_body, size, (x - (1 - part) * dx, y - (1 - part) * dy)))
            for i in np.flatnonzero(going):
                x, y = before[i, :2] + part * (robots.poses[i, :2] - before[i, :2])
                hit = space.point_query_nearest((float(x), float(y)), 100.0, pymunk.ShapeFilter())
                assert hit is not None
                nearest[i] = min(nearest[i], hit.distance - radius)
        # 0.35 m in 25 parts: between two of them a way may come 7 mm nearer.
        assert (nearest[going] > -0.01).all()
        for i in np.flatnonzero(robots.outcomes == 2):
            assert robots.records["min_clearance"][i] < ROUNDING


def test_a_collision_with_a_mover_worked_by_hand() -> None:
    # A patrol of 0.2 m at 1.5 m/s comes up x = 0 in strides of 0.3 m; the robot of 0.105 m stands at (0.29, 0).
    line = ((0.0, -4.5), (0.0, 4.5))
    arena = Arena("hand", movers=(Mover("patrol", 0.2, 1.5, line),))
    world = World(TaskConfig(collision_distance=0.0), (arena,), 1, seed=3)
    world.reset(poses=(0.29, 0.0, np.pi), targets=(4.0, 4.0))
    touched: list[int] = []
    while not touched:
        y = float(world.movers.discs[0, 0, 1])
        world.step(np.zeros((1, 2), dtype=np.float32))
        moved = world.movers.discs[0, 0, 1]
        # They touch where the mover is within sqrt(0.305² - 0.29²) = 0.0945 m of y = 0, which a stride may step over.
        if min(y, moved) <= 0.0945 and max(y, moved) >= -0.0945:
            touched.append(world.robots.outcomes[0])
        else:
            assert world.robots.outcomes[0] == 0
    assert touched == [2]


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_rectangular_body_meets_movers_as_chipmunk_says(seed: int) -> None:
    task = TaskConfig(robot=JackalConfig(), collision_distance=0.0)
    hall = Arena("hall", movers=(Mover("pedestrian", 0.2, 1.5), Mover("walker", 0.4, 1.5)) * 6)
    world = World(task, (hall,), 30, seed=seed)
    world.reset()
    body, shape = robot_body(task.robot)
    # They stand, and are looked at on the way of what moves.
    for _ in range(40):
        poses = world.robots.poses.copy()
        world.step(np.zeros((30, 2), dtype=np.float32))
        discs = world.movers.discs[0].astype(np.float64)
        for i, (x, y, heading) in enumerate(poses.astype(np.float64).tolist()):
            body.position, body.angle = (x, y), heading
            shape.cache_bb()
            nearest = min(
                shape.point_query((mx - part * dx, my - part * dy)).distance - radius
                for mx, my, radius, dx, dy in discs[np.hypot(*(discs[:, :2] - (x, y)).T) < 1.2].tolist() or [[9, 9, 0, 0, 0]]
                for part in np.linspace(0.0, 1.0, 16)
            )
            if abs(nearest) > 0.01:  # 0.3 m in 16 parts: between two of them a way may come some millimetres nearer
                assert (world.robots.outcomes[i] == 2) == (nearest < 0.0)


def test_a_robot_that_is_drawn_fast_does_not_pass_through_movers() -> None:
    # Up to 3 m/s and half a second: with a mover of 1.5 m/s that comes towards it 2.25 m in a step, while the robot's own
    # setting of 0.25 m/s would only make 0.875 m.
    task = TaskConfig(
        collision_distance=0.0, control_period=0.5, randomisation=RandomisationConfig(max_linear_speed=(0.25, 3.0))
    )
    hall = Arena("hall", 8.0, 8.0, movers=(Mover("walker", 0.2, 1.5),) * 16)
    world = World(task, (hall,), 64, seed=0)
    world.reset()
    ahead = np.tile(np.array([[1.0, 0.0]], dtype=np.float32), (64, 1))
    passed = 0
    for _ in range(40):
        before = world.robots.poses[:, :2].astype(np.float64)
        driven = world.robots.drawn[:, [MAX_LINEAR]] * 0.5
        heading = world.robots.poses[:, 2].astype(np.float64)
        after = before + driven * np.stack([np.cos(heading), np.sin(heading)], axis=1)
        world.step(ahead)
        discs = world.movers.discs[world.tiles()].astype(np.float64)
        # A mover beside the robot that is held still: from where it was to where it came, less the robot's own way.
        ends = discs[:, :, :2] - after[:, None]
        starts = discs[:, :, :2] - discs[:, :, 3:] - before[:, None]
        ways = ends - starts
        part = -(starts * ways).sum(axis=-1) / np.maximum((ways * ways).sum(axis=-1), 1e-12)
        nearest = np.hypot(*np.moveaxis(starts + np.clip(part, 0.0, 1.0)[..., None] * ways, -1, 0)) - discs[:, :, 2] - 0.105
        through = (nearest < -0.01).any(axis=1) & (np.abs(after) < 7.5).all(axis=1) & (world.robots.outcomes != 1)
        passed += int(np.count_nonzero(through))
        assert (world.robots.outcomes[through] == 2).all()
    assert passed > 20


def test_a_crowded_cell_has_scenarios_too() -> None:
    cell = Arena("cell", 1.5, 1.5, movers=(Mover("pedestrian", 0.25, 1.0),) * 3)
    assert len(draw_scenarios("cell", (cell,), 5)) == 5


def test_the_lidar_sees_a_mover() -> None:
    arena = Arena("seen", movers=(Mover("patrol", 0.2, 0.5, ((2.0, 0.0), (2.0, 1e-6))),))
    world = World(
        TaskConfig(lidar=LidarConfig(rays=3), observation=ObservationConfig.preset("improved", batches=3)),
        (arena,),
        1,
        seed=0,
    )
    world.reset(poses=(0.0, 0.0, 0.0), targets=(-3.0, 0.0))
    assert world.robots.ranges[0] == pytest.approx([3.5, 1.8, 3.5])


def test_starts_are_clear_of_movers() -> None:
    envs = NavigationVectorEnv(CROWD, 64, seed=1)
    envs.reset()
    discs = envs._world.movers.discs[0]
    apart = np.hypot(*np.moveaxis(envs.poses[:, None, :2] - discs[:, :2], -1, 0))
    assert (apart - discs[:, 2] - 0.105).min() >= 1.0 - ROUNDING


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_robot_meets_the_same_movers_whoever_drives_beside_it(seed: int) -> None:
    actions = random_actions(seed, 150, 100)
    many = NavigationVectorEnv(CROWD, 100, seed=seed)
    few = NavigationVectorEnv(CROWD, 3, seed=seed)
    assert np.array_equal(many.reset()[0][:3], few.reset()[0])
    for action in actions:
        for ours, theirs in zip(many.step(action)[:4], few.step(action[:3])[:4], strict=True):
            assert np.array_equal(ours[:3], theirs)
    movers = [envs._world.movers.discs for envs in (many, few)]
    assert np.array_equal(movers[0][:1], movers[1])
    # The second copy of the arena has movers of its own.
    assert not np.array_equal(movers[0][0], movers[0][1])


def test_a_state_with_movers_goes_on_bit_for_bit() -> None:
    envs = NavigationVectorEnv(CROWD, 50, seed=7)
    envs.reset()
    actions = random_actions(0, 201, 50)
    drive(envs, actions[:101])
    state = envs.get_state()
    expected = drive(envs, actions[101:])
    other = NavigationVectorEnv(CROWD, 50, seed=99)
    other.reset()
    other.set_state(state)
    for ours, theirs in zip(expected, drive(other, actions[101:]), strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(ours, theirs, strict=True))
    assert not [name for name in NavigationVectorEnv(num_envs=2).get_state() if name.startswith("mover")]


def test_every_policy_and_every_scenario_of_a_suite_meets_the_same_movers() -> None:
    suite = load_suite("crowd-200")
    task = TaskConfig()
    full = scenario_world(task, suite.arenas, 200)
    full.reset(poses=suite.starts, targets=suite.targets, arenas=suite.arena_indices)
    one = scenario_world(task, suite.arenas, 1)
    one.reset(poses=suite.starts[77], targets=suite.targets[77], arenas=suite.arena_indices[77])
    policy = go_to_goal(task)
    for _ in range(100):
        full.step(policy(full.robots.observations))
        one.step(np.zeros((1, 2), dtype=np.float32))
    assert np.array_equal(full.movers.discs, one.movers.discs)
    # Copies of an arena, which many scenarios in it need, are alike too.
    copies = scenario_world(CROWD, build_arenas(CROWD.arena), 100).movers
    copies.place()
    assert np.array_equal(copies.discs[0], copies.discs[1])


def test_the_starts_of_the_crowd_are_clear_of_its_movers() -> None:
    suite = load_suite("crowd-200")
    movers = scenario_world(TaskConfig(), suite.arenas, 1).movers
    movers.place()
    for index, start in zip(suite.arena_indices, suite.starts, strict=True):
        assert movers.distance(int(index), start[:2]) >= 1.1


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_velocity_chosen_is_the_best_there_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    hard, soft = rng.integers(0, 5, 2)
    count = hard + soft
    angles = rng.uniform(-np.pi, np.pi, count)
    lines = np.column_stack([np.cos(angles), np.sin(angles), rng.uniform(-0.6, 1.0, count)])
    lines[:hard, 2] = np.abs(lines[:hard, 2])
    wish = rng.uniform(-1.0, 1.0, 2)
    velocity = np.zeros(2)
    choose_velocity(lines, hard, count, 1.0, wish[0], wish[1], np.zeros((count + 1, 3)), velocity)
    assert np.hypot(*velocity) <= 1.0 + 1e-9
    radii, directions = np.meshgrid(np.linspace(0.0, 1.0, 60), np.linspace(-np.pi, np.pi, 181))
    grid = np.stack([radii * np.cos(directions), radii * np.sin(directions)], axis=-1).reshape(-1, 2)
    excess = grid @ lines[:, :2].T - lines[:, 2]
    ours = lines[:, :2] @ velocity - lines[:, 2]
    assert (ours[:hard] <= 1e-9).all()
    allowed = (excess[:, :hard] <= 0.0).all(axis=1)
    possible = allowed & (excess <= 0.0).all(axis=1)
    if possible.any():
        assert (ours <= 1e-9).all()
        assert np.hypot(*(velocity - wish)) <= np.hypot(*(grid[possible] - wish).T).min() + 1e-9
    else:
        assert ours[hard:].max(initial=0.0) <= max(excess[allowed, hard:].max(axis=1, initial=0.0).min(), 0.0) + 1e-9
    assert free_part(lines, hard, velocity[0], velocity[1]) == pytest.approx(1.0, abs=1e-6)


def test_too_many_movers_are_refused() -> None:
    with pytest.raises(ArenaError, match="at most 16"):
        Arena("crowd", movers=(Mover("walker", 0.2, 1.0),) * 17)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_what_movers_leave_out_of_sight_makes_no_difference(seed: int) -> None:
    arenas = (random_arena(seed), random_arena(seed + 1))
    bounds, circles, boxes = pack_shapes(arenas)
    near_ones = hulls(circles, boxes)
    all_of_them = near_ones.copy()
    all_of_them[:, 2][all_of_them[:, 0] < 1e5] = 1e3
    rng = np.random.default_rng(seed)
    index, angle, keep = rng.integers(2), rng.uniform(-np.pi, np.pi), rng.uniform(0.1, 0.6)
    x, y = rng.uniform(-1.0, 1.0, 2) * bounds[index]
    near, found = np.empty(near_ones.shape[2] + 1, dtype=np.int32), []
    for discs in (near_ones, all_of_them):
        lines = np.zeros((near_ones.shape[2] + 4, 3))
        count = obstacle_lines(x, y, keep, 1.5 * keep, 0.6, index, bounds, circles, boxes, discs, near, lines)
        length = free_length(x, y, np.cos(angle), np.sin(angle), keep, index, bounds, circles, boxes, discs, near)
        found.append((count, length, lines.tolist()))
    assert found[0] == found[1]


def test_hulls_hold_what_they_stand_for() -> None:
    circles = np.array([[(1.0, 2.0, 0.5), (-1.0, -1.0, -1.0)]], dtype=np.float32)
    boxes = np.array([[(-2.0, 0.0, 0.3, 0.4, 1.0, 0.0)]], dtype=np.float32)
    discs = hulls(circles, boxes)[0].T
    assert discs[[0, 2]] == pytest.approx(np.array([(1.0, 2.0, 0.5), (-2.0, 0.0, 0.5)]), abs=1e-4)
    assert discs[1, 0] > 1e5
