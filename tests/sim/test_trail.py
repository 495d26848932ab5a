"""What a robot sees of where it has been: numbers worked by hand, the plain reference, every LiDAR, and what forgets it."""

import numpy as np
import pytest

from sim.arenas import Arena
from sim.config import (
    ArenaConfig,
    GeneratedArenaConfig,
    LidarConfig,
    ObservationConfig,
    OdometryConfig,
    TaskConfig,
    TrailPart,
)
from sim.engine.plain_trail import PlainTrail
from sim.engine.world import World
from sim.envs.vector import NavigationVectorEnv
from sim.kernels.room import LONG_TRAIL_ROOM, SHORT_TRAIL_ROOM
from sim.observations import observation_layout
from tests.sim.scenes import LIDARS, goes_on_bit_for_bit

WALL = np.array([[0.0, 1.5, 1.0, 0.1, 0.0]])
FULL = LIDARS["full circle"]


def seen(sectors: int = 4, lidar: LidarConfig = FULL, memory: str = "short", **task: object) -> TaskConfig:
    part = TrailPart.model_validate({"sectors": sectors, "memory": memory})
    return TaskConfig.model_validate({"lidar": lidar, "observation": ObservationConfig(parts=(part,)), **task})


def world(task: TaskConfig, *boxes: np.ndarray) -> World:
    arena = Arena("room", 5.0, 5.0, boxes=np.concatenate(boxes) if boxes else np.empty((0, 5)))
    return World(task, (arena,), 1, seed=0)


def drive(made: World, steps: int, linear: float = 1.0, angular: float = 0.0) -> None:
    for _ in range(steps):
        made.step(np.array([[linear, angular]], np.float32))


def test_a_straight_way_lies_behind_the_robot() -> None:
    made = world(seen())
    made.reset(poses=(-3.0, 0.0, 0.1 - 0.1), targets=(4.0, 3.0))
    assert made.robots.observations[0] == pytest.approx([0.0] * 12 + [1 / 41])
    drive(made, 20)
    # After 1 m by steps of 0.05 m: crumbs 0.25 m apart, at 0, 0.25, 0.5, 0.75 and here; four of them behind it. They lie
    # straight behind, where the first sector begins and the last ends: rounding says which, so the robot turns a little.
    drive(made, 1, 0.0, 0.5)
    nearness, count, freshness = made.robots.observations[0, :12].reshape(3, 4)
    assert nearness == pytest.approx([1 - 0.25 / 3.5, 0, 0, 0]) or nearness == pytest.approx([0, 0, 0, 1 - 0.25 / 3.5])
    assert sorted(count) == pytest.approx([0, 0, 0, 4 / 9])
    assert sorted(freshness) == pytest.approx([0, 0, 0, 10 / 11])
    assert made.robots.observations[0, 12] == pytest.approx(5 / 45)


def test_crumbs_behind_a_wall_are_out_of_sight() -> None:
    made = world(seen(), WALL)
    # It drives past the end of the wall and round it: what it dropped on the other side is hidden.
    made.reset(poses=(0.0, 0.8, 0.0), targets=(-4.0, -4.0))
    drive(made, 30)
    assert made.robots.observations[0, 4:8].max() > 0.0
    trail = np.array(made.robots.trail[0, : made.robots.crumbs[0]])
    made.robots.poses[0] = (0.0, 2.2, 0.0)
    plain = PlainTrail(FULL)
    for place in trail.tolist():
        plain.drop(place)
    blocked = np.full(120, 0.6)
    assert plain.seen(blocked, (0.0, 2.2, 0.0), TrailPart(sectors=4))[:12].max() == 0.0
    assert plain.seen(np.full(120, 3.5), (0.0, 2.2, 0.0), TrailPart(sectors=4))[:12].max() > 0.0


def test_with_a_long_memory_old_crumbs_have_ages_that_differ() -> None:
    made = world(seen(memory="long"))
    made.reset(poses=(-3.0, 0.0, 0.0), targets=(4.0, 3.0))
    assert made.robots.observations[0] == pytest.approx([0.0] * 16 + [1 / 161])
    drive(made, 20)
    drive(made, 1, 0.0, 0.5)
    # As in the test above five crumbs, the newest underfoot: the others were followed by one, two, three and four.
    nearness, count, freshness, first = made.robots.observations[0, :16].reshape(4, 4)
    behind = nearness.argmax()
    assert count[behind] == pytest.approx(4 / 9)
    assert freshness[behind] == pytest.approx(1 - np.log(2) / np.log(1025), abs=1e-6)
    assert first[behind] == pytest.approx(1 - np.log(5) / np.log(1025), abs=1e-6)
    assert np.count_nonzero(first) == np.count_nonzero(nearness) == 1


@pytest.mark.parametrize("memory", ["short", "long"])
@pytest.mark.parametrize("lidar", LIDARS.values(), ids=LIDARS)
def test_it_is_what_the_plain_reference_sees(lidar: LidarConfig, memory: str) -> None:
    task = seen(
        24,
        lidar,
        memory,
        arena=ArenaConfig(name="complex"),
        odometry=OdometryConfig(distance_noise=0.05, heading_noise=0.05),
        step_limit=2000,
        arrival_distance=0.05,
    )
    made = World(task, NavigationVectorEnv(task, 1).arenas, 1, seed=3)
    made.reset()
    random, compared, told = np.random.default_rng(0), 0, 0
    robots = made.robots
    plain: PlainTrail | None = None
    for _ in range(400):
        if plain is None:
            plain = PlainTrail(task.lidar)
        believed = (robots.poses[0] + robots.drift[0]).astype(float)
        plain.drop(believed[:2])
        part = task.observation.parts[0]
        assert isinstance(part, TrailPart)
        expected = plain.seen(robots.ranges[0].astype(float), believed, part)
        # A crumb on the edge of a sector or of what a ray meets falls on either side: three numbers of two sectors.
        assert np.count_nonzero(np.abs(robots.observations[0] - expected) > 1e-3) <= 8
        compared += bool((np.abs(robots.observations[0] - expected) < 1e-3).all())
        told += int(np.count_nonzero(expected[:24]))
        made.step(np.array([[random.uniform(0.3, 1.0), random.uniform(-1.0, 1.0)]], np.float32))
        if robots.outcomes[0]:
            plain = None
    assert compared > 390
    assert told > 100


@pytest.mark.parametrize(("memory", "room", "steps"), [("short", SHORT_TRAIL_ROOM, 1500), ("long", LONG_TRAIL_ROOM, 5500)])
def test_the_oldest_crumbs_are_forgotten(memory: str, room: int, steps: int) -> None:
    made, plain = world(seen(memory=memory, step_limit=10_000)), PlainTrail(FULL)
    made.reset(poses=(0.0, 0.0, 0.0), targets=(4.5, 4.5))
    plain.drop(made.robots.poses[0, :2].tolist())
    for _ in range(steps):  # round and round: 75 or 275 m
        made.step(np.array([[1.0, 0.5]], np.float32))
        plain.drop(made.robots.poses[0, :2].tolist())
    assert made.robots.crumbs[0] > room
    pose = made.robots.poses[0].astype(float)
    part = TrailPart.model_validate({"sectors": 4, "memory": memory})
    expected = plain.seen(made.robots.ranges[0].astype(float), pose, part)
    assert made.robots.observations[0] == pytest.approx(expected, abs=0.02)


def test_a_new_target_and_a_new_episode_begin_a_new_trail() -> None:
    task = seen(arrival_distance=0.3)
    made = world(task)
    made.reset(poses=(-3.0, 0.0, 0.0), targets=(0.0, 0.0))
    while not made.robots.outcomes[0]:
        drive(made, 1)
    assert made.robots.observations[0] == pytest.approx([0.0] * 12 + [1 / 41])  # an arrival
    while not made.robots.terminations[0]:
        drive(made, 1)
    assert made.robots.observations[0] == pytest.approx([0.0] * 12 + [1 / 41])  # a wall
    assert made.robots.final_observations[0, 12] > 2 / 42


def test_a_training_goes_on_bit_for_bit() -> None:
    goes_on_bit_for_bit(TrailPart(frames=2))


def test_its_numbers_have_names_and_stay_in_their_ranges() -> None:
    layout = observation_layout(seen(6))
    assert layout.size == 19
    assert [layout.numbers[k].name for k in (0, 6, 12, 18)] == [
        "trail nearness 0",
        "trail crumbs 0",
        "trail freshness 0",
        "trail length",
    ]
    assert {(number.low, number.high) for number in layout.numbers} == {(0.0, 1.0)}


def test_where_an_arrival_ends_the_episode_the_next_one_is_anywhere() -> None:
    task = TaskConfig(arena=GeneratedArenaConfig(name="varied", maps=8), arrival_ends=True, arrival_distance=1.0)
    env = NavigationVectorEnv(task, 200, seed=0)
    env.reset()
    arrived, ended = 0, 0
    for _ in range(150):
        _, _, terminations, _, _ = env.step(np.tile(np.array([1.0, 0.0], np.float32), (200, 1)))
        arrived += int((env.outcomes == 1).sum())
        ended += int((terminations & (env.outcomes == 1)).sum())
    assert arrived == ended > 10
