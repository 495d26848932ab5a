"""Movers that see robots: they treat a robot as another mover, walk into none that stands, and follow routes."""

import dataclasses

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sim.arenas import Arena, Mover, free_distance
from sim.arenas.document import to_arena, to_document
from sim.baselines.simple import go_to_goal
from sim.config import ArenaFile, JackalConfig, MoverKind, MoversConfig, TaskConfig
from sim.engine.world import World
from sim.errors import ArenaError, PlacementError, SuiteError
from sim.suites import Suite, SuiteRules, content_hash, load_suite, run_controller
from sim.suites.people import body_gaps, robots_fault, run_among_people
from sim.suites.scenarios import scenario_world
from tests.sim.scenes import random_arena

TASK = TaskConfig(step_limit=10_000)
STAND = np.zeros((1, 2), dtype=np.float32)
PERSON = Mover("pedestrian", 0.25, 1.0, ((-3.0, 0.0), (3.0, 0.0)), sees_robots=True)


def seeing(movers: tuple[Mover, ...]) -> tuple[Mover, ...]:
    return tuple(dataclasses.replace(mover, sees_robots=True) for mover in movers)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_robot_is_to_them_what_another_pedestrian_is(seed: int) -> None:
    # The robot's 0.2 m around its centre, where and as fast as a pedestrian of 0.2 m: the same decision, but for rounding.
    rng = np.random.default_rng(seed)
    place, heading, speed = rng.uniform([-1.5, -1.5], 1.5), float(rng.uniform(-3.0, 3.0)), float(rng.uniform(0.1, 0.25))
    wall = Arena("hall", 4.0, 4.0, boxes=np.array([[0.0, 2.5, 0.5, 0.2, 0.0]]))
    fast = TASK.robot.max_linear_speed
    world = World(TASK, (dataclasses.replace(wall, movers=(PERSON,)),), 1, seed=0)
    world.reset(poses=(*place, heading), targets=(-3.5, -3.5))
    world.robots.records["linear"] = speed / fast
    other = Mover("pedestrian", TASK.passable_clearance, speed, (tuple(place.tolist()),))
    crowd = World(
        TASK, (dataclasses.replace(wall, movers=(dataclasses.replace(PERSON, sees_robots=False), other)),), 1, seed=0
    )
    crowd.reset(poses=(3.5, -3.5, 0.0), targets=(-3.5, -3.5))
    walking = rng.uniform(-0.7, 0.7, 2)
    driven = np.float32(speed / fast) * fast * np.array([np.cos(np.float32(heading)), np.sin(np.float32(heading))])
    for movers in (world.movers, crowd.movers):
        movers._records["vx"][0], movers._records["vy"][0] = walking
        movers._records["x"][0] = rng.integers(1)  # both in the middle, so that most of these robots matter
    crowd.movers._records["x"][1], crowd.movers._records["y"][1] = world.robots.poses[0, :2]
    crowd.movers._records["vx"][1], crowd.movers._records["vy"][1] = driven
    world.step(STAND)
    crowd.step(STAND)
    decided = [(movers._records["vx"][0], movers._records["vy"][0]) for movers in (world.movers, crowd.movers)]
    assert decided[0] == pytest.approx(decided[1], abs=1e-6)


def gaps_to_people(world: World) -> NDArray[np.float64]:
    """(robots, movers) metres between a robot's centre and a mover's edge."""
    discs = world.movers.discs[world.tiles()].astype(np.float64)
    away: NDArray[np.float64] = np.hypot(*np.moveaxis(discs[..., :2] - world.robots.poses[:, None, :2], -1, 0))
    return away - discs[..., 2]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
@example(7157)  # one of its robots starts beside a person who stands there
def test_nobody_walks_into_a_robot_that_stands(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds: tuple[MoverKind, ...] = ("patrol", "walker", "pedestrian")
    movers = tuple(Mover(kinds[k % 3], float(rng.uniform(0.1, 0.4)), float(rng.uniform(0.3, 1.5))) for k in range(9))
    arena = dataclasses.replace(random_arena(seed), movers=seeing(movers))
    try:
        world = World(TASK, (arena,), 4, seed=seed)
    except ArenaError:
        return  # no room for a robot
    world.reset()
    # Where there is little room, one may start in touch with a person or an obstacle.
    walked, standing = 0.0, gaps_to_people(world).min(axis=1) > TASK.passable_clearance
    for _ in range(100):
        world.step(np.zeros((4, 2), dtype=np.float32))
        standing &= world.robots.outcomes == 0
        discs, gaps = world.movers.discs[world.tiles()], gaps_to_people(world)
        assert gaps[standing].min(initial=1.0) > TASK.passable_clearance
        walked += float(np.abs(discs[..., 3:]).sum())
    assert walked > 10.0


def test_who_does_not_see_walks_into_it() -> None:
    # 3 m off, straight on: one of them stops and goes round, the other does not.
    for sees, met in ((True, 0), (False, 2)):
        world = World(TASK, (Arena("hand", movers=(dataclasses.replace(PERSON, sees_robots=sees),)),), 1, seed=0)
        world.reset(poses=(0.0, 0.0, np.pi), targets=(4.0, 4.0))
        outcomes = set()
        for _ in range(40):
            world.step(STAND)
            outcomes.add(int(world.robots.outcomes[0]))
            if world.robots.outcomes[0]:
                break
        assert max(outcomes) == met
    # Who saw it has gone round, and has come to the end of the route meanwhile, and back.
    assert world.movers.discs.shape == (1, 1, 5)


def test_a_scenario_is_the_same_whoever_drives_beside_it() -> None:
    # Two robots in one arena: what the people of one do does not depend on the other.
    arena = Arena("hall", movers=seeing((Mover("pedestrian", 0.25, 1.0),) * 5))
    poses = np.array([[0.0, 0.0, 0.0], [2.0, 2.0, 1.0]])
    both = scenario_world(TASK, (arena,), 2)
    both.reset(poses=poses, targets=((4.0, 4.0), (-4.0, 4.0)), arenas=(0, 0))
    actions = np.array([[1.0, 0.3], [0.5, -0.4]], dtype=np.float32)
    alone = scenario_world(TASK, (arena,), 1)
    alone.reset(poses=poses[1], targets=(-4.0, 4.0), arenas=(0,))
    for _ in range(60):
        both.step(actions)
        alone.step(actions[1:])
        if both.robots.outcomes.any():
            break
        assert (both.movers.discs[1] == alone.movers.discs[0]).all()
    assert not (both.movers.discs[0] == both.movers.discs[1]).all()
    with pytest.raises(PlacementError, match="need a copy of an arena each"):
        scenario_world(TASK, (arena, arena), 2).reset(poses=poses, targets=((4.0, 4.0), (-4.0, 4.0)), arenas=(0, 0))


def test_a_route_is_walked_corner_by_corner() -> None:
    corners = ((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0))
    walks_on, stays = Mover("pedestrian", 0.2, 1.0, corners), Mover("pedestrian", 0.2, 1.0, corners, loops=False)
    for mover, end in ((walks_on, None), (stays, corners[-1])):
        world = World(TASK, (Arena("hall", movers=(mover,)),), 1, seed=4)
        world.reset(poses=(-4.0, 4.0, 0.0), targets=(4.0, 4.0))
        assert world.movers.discs[0, 0, :2] == pytest.approx(corners[0])
        places = []
        for _ in range(120):
            world.step(STAND)
            places.append(world.movers.discs[0, 0, :2].copy())
        near = [min(float(np.hypot(*(place - corner))) for place in places) for corner in corners]
        assert max(near) < 0.5
        if end is not None:
            assert places[-1] == pytest.approx(end, abs=0.02)
        else:
            assert np.hypot(*(places[-1] - places[-20])) > 1.0


def test_who_waits_steps_aside_and_comes_back() -> None:
    # A queue's place, and somebody who walks close by: both give way, and the place is taken again.
    place = (0.0, 0.1)
    people = (Mover("pedestrian", 0.25, 1.0, (place,)), dataclasses.replace(PERSON, loops=False))
    world = World(TASK, (Arena("hall", movers=people),), 1, seed=0)
    world.reset(poses=(-4.0, 4.0, 0.0), targets=(4.0, 4.0))
    ways = []
    for _ in range(80):
        world.step(STAND)
        ways.append(world.movers.discs[0, :, :2].astype(float))
    aside = np.hypot(*(np.array(ways)[:, 0] - place).T)
    assert aside.max() > 0.1
    assert aside[-1] < 0.03
    assert ways[-1][1] == pytest.approx((3.0, 0.0), abs=0.03)


def test_arena_files_say_who_sees_and_keep_their_hash_where_nobody_does() -> None:
    entry = {"kind": "pedestrian", "radius": 0.25, "speed": 1.2}
    plain = ArenaFile.model_validate({"name": "a", "width": 6.0, "height": 5.0, "movers": [entry]})
    assert plain.sha256 == "86c1b99187e8d49e633ace6ff2defbd331bffe7b5403197fbae8b8a059b384a6"
    told = entry | {"sees_robots": True, "stays": True, "waypoints": [{"x": 1.0, "y": 0.0}]}
    document = ArenaFile.model_validate({"name": "a", "width": 6.0, "height": 5.0, "movers": [told]})
    arena = to_arena(document)
    assert arena.movers == (Mover("pedestrian", 0.25, 1.2, ((1.0, 0.0),), loops=False, sees_robots=True),)
    assert to_document(arena).movers == document.movers
    hashes = {content_hash((to_arena(each),), []) for each in (plain, document)}
    assert len(hashes) == 2


def test_a_setting_of_all_movers_of_a_training() -> None:
    seen = MoversConfig(count=2, sees_robots=True)
    task = TaskConfig.model_validate({"arena": {"name": "simple", "movers": seen.model_dump()}})
    assert task.arena.movers.sees_robots
    assert MoversConfig.model_validate({"count": 2}).sees_robots is False


PEOPLE, HEEDLESS = "people-500", "heedless-500"


def part(name: str, every: int, first: int = 0) -> Suite:
    """Some scenarios of a suite."""
    suite = load_suite(name)
    names = ("arena_indices", "starts", "targets", "shortest_paths")
    return dataclasses.replace(suite, **{each: getattr(suite, each)[first::every] for each in names})


def test_scenes_have_room_for_the_robot_and_for_everybody() -> None:
    suite = load_suite(PEOPLE)
    assert len(suite) == 500
    world = scenario_world(suite.rules.task(), suite.arenas, 1)
    world.movers.place()
    for index, arena in enumerate(suite.arenas):
        start, target = suite.starts[index], suite.targets[index]
        assert free_distance(arena, [start[:2], target]).min() > 0.3
        corners = np.array([corner for mover in arena.movers for corner in mover.waypoints])
        assert free_distance(arena, corners).min() > 0.25, arena.name
        assert (world.movers.discs[index, : len(arena.movers), 2] > 0.0).all(), arena.name
        assert world.movers.distance(index, start[:2]) > 0.9, arena.name


def test_people_who_see_and_who_do_not_start_alike_on_the_same_ways() -> None:
    seeing_ones, heedless = load_suite(PEOPLE), load_suite(HEEDLESS)
    assert seeing_ones.hash != heedless.hash
    assert (seeing_ones.starts == heedless.starts).all()
    for one, other in zip(seeing_ones.arenas, heedless.arenas, strict=True):
        assert one.movers == seeing(other.movers) != other.movers


def test_a_suite_of_people_is_for_its_robot_only() -> None:
    with pytest.raises(SuiteError, match="is for the robot"):
        run_controller(lambda _: STAND, TaskConfig(), part(PEOPLE, 500))


def test_a_robot_that_stands_is_never_at_fault_and_not_hit_by_people_who_see() -> None:
    task = load_suite(PEOPLE).rules.task()
    tables = {}
    for name in (PEOPLE, HEEDLESS):
        suite = part(name, 25)
        tables[name] = run_among_people(lambda s: np.zeros((len(s.poses), 2), np.float32), task, suite)
        assert not tables[name].at_fault.any()
    assert (tables[PEOPLE].episodes.outcomes == 3).all()
    assert (tables[HEEDLESS].episodes.outcomes == 2).mean() > 0.3
    assert tables[PEOPLE].intrusion.max() > 0.0
    # An attempt of 60 s is 300 steps of 0.2 s.
    assert (tables[PEOPLE].episodes.steps == 300).all()


def test_who_drives_blindly_is_at_fault_and_holds_people_up() -> None:
    task = load_suite(PEOPLE).rules.task()
    policy = go_to_goal(task)
    table = run_among_people(lambda s: policy(s.observations), task, part(PEOPLE, 10))
    hit = table.episodes.outcomes == 2
    assert 0.0 < hit.mean() < 0.9
    assert table.at_fault[hit].mean() > 0.8
    assert table.delay.mean() > 0.0


@pytest.mark.parametrize(
    ("before", "after", "disc", "fault"),
    [
        # The robot of 0.25 m at x = 0, a person of 0.25 m at its front: who moved?
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.49, 0.0, 0.25, -0.2, 0.0), False),  # the person
        ((-0.2, 0.0, 0.0), (0.0, 0.0, 0.0), (0.49, 0.0, 0.25, 0.0, 0.0), True),  # the robot
        ((-0.1, 0.0, 0.0), (0.0, 0.0, 0.0), (0.49, 0.0, 0.25, -0.1, 0.0), True),  # both
        ((0.1, 0.0, 0.0), (0.0, 0.0, 0.0), (0.49, 0.0, 0.25, -0.3, 0.0), False),  # the person, while the robot backed away
        ((-0.2, 0.0, 0.0), (0.0, 0.0, 0.0), (3.0, 0.0, 0.25, 0.0, 0.0), True),  # nobody: it was a wall
    ],
)
def test_a_collision_is_the_robots_where_its_own_motion_closes_the_gap(
    before: tuple[float, ...], after: tuple[float, ...], disc: tuple[float, ...], fault: bool
) -> None:
    task = load_suite(PEOPLE).rules.task()
    found = robots_fault(np.array([before]), np.array([after]), np.array([[disc]]), task)
    assert found.tolist() == [fault]


def test_gaps_of_a_rectangular_body() -> None:
    # 0.508 x 0.43 m at (1, 1), turned by a quarter: 0.254 m up and down, 0.215 m left and right.
    discs = np.array([[[1.0, 2.0, 0.25], [2.0, 1.0, 0.25], [0.0, 0.0, -1.0]]])
    gaps = body_gaps(np.array([[1.0, 1.0, np.pi / 2]]), discs, TaskConfig(robot=JackalConfig()))
    assert gaps[0] == pytest.approx([1.0 - 0.254 - 0.25, 1.0 - 0.215 - 0.25, np.inf])


def test_attempts_last_four_times_the_shortest_path_where_a_suite_says_so() -> None:
    # At 0.25 m/s and 0.2 s: 10 m are 200 steps, and 40 m are 800.
    paths = np.array([10.0, 25.0, 40.0])
    assert SuiteRules(patience=4.0).step_limits(TaskConfig(), paths).tolist() == [800, 2000, 3200]
    assert SuiteRules(patience=4.0).step_limits(TaskConfig(), np.array([1.0])).tolist() == [500]
    assert SuiteRules(time_limit=100.0).step_limits(TaskConfig(), paths).tolist() == [500, 500, 500]
    assert SuiteRules().step_limits(TaskConfig(step_limit=77), paths).tolist() == [77, 77, 77]
    hall = Arena("hall")
    suite = Suite("two", "", (hall,), np.zeros(2, np.int32), np.zeros((2, 3)), np.full((2, 2), 4.0), np.array([1.0, 30.0]))
    suite = dataclasses.replace(suite, rules=SuiteRules(patience=4.0))
    table = run_controller(lambda s: np.zeros((len(s.poses), 2), np.float32), TaskConfig(), suite)
    assert (table.outcomes.tolist(), table.steps.tolist()) == ([3, 3], [500, 2400])
