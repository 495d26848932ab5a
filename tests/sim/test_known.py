"""Since when a robot knows what it sees: numbers worked by hand, the plain reference, every LiDAR, and what forgets it."""

import math

import numpy as np
import pytest

from sim.arenas import Arena
from sim.config import (
    ArenaConfig,
    KnownPart,
    LidarConfig,
    ObservationConfig,
    OdometryConfig,
    TaskConfig,
)
from sim.engine.plain_known import seen_known
from sim.engine.plain_views import PlainViews
from sim.engine.world import World
from sim.envs.vector import NavigationVectorEnv
from sim.kernels.room import VIEW_ROOM
from sim.observations import observation_layout
from tests.sim.scenes import LIDARS, goes_on_bit_for_bit

FULL = LIDARS["full circle"]


def seen(sectors: int = 4, lidar: LidarConfig = FULL, *, progress: bool = False, **task: object) -> TaskConfig:
    parts = (KnownPart(sectors=sectors, progress=progress),)
    return TaskConfig.model_validate({"lidar": lidar, "observation": ObservationConfig(parts=parts), **task})


def world(task: TaskConfig, *boxes: tuple[float, ...]) -> World:
    arena = Arena("room", 5.0, 5.0, boxes=np.array(boxes) if boxes else np.empty((0, 5)))
    return World(task, (arena,), 1, seed=0)


def drive(made: World, steps: int, linear: float = 1.0, angular: float = 0.0) -> None:
    for _ in range(steps):
        made.step(np.array([[linear, angular]], np.float32))


def since(views: int) -> float:
    """How fresh what was first seen so many views ago is."""
    return 1.0 - math.log(1.0 + views) / math.log(1.0 + VIEW_ROOM)


def test_at_first_everything_is_new_and_as_far_away_as_it_looks() -> None:
    made = world(seen())
    made.reset(poses=(0.0, 0.0, 0.0), targets=(4.0, 3.0))
    # Nothing is within 3.5 m: each sight ends 3.3 m away, and the only view was kept here.
    assert made.robots.observations[0] == pytest.approx([1.0] * 4 + [1 - 3.3 / 3.5] * 4, abs=1e-6)


def test_what_lies_ahead_becomes_new_and_what_was_passed_is_known_since_then() -> None:
    made = world(seen(sectors=30))
    made.reset(poses=(-4.0, 0.0, 0.0), targets=(4.0, 3.0))
    drive(made, 65)
    # After 3.25 m by steps of 0.05 m: views at 0, 0.5, 1, 1.5, 2, 2.5 and 3 m.
    assert made.robots.views_kept[0] == 7
    freshness, nearness = made.robots.observations[0].reshape(2, 30)
    # Straight ahead it sees 6.55 m from its start, and saw that from no view but the newest, 3.55 m before it.
    assert freshness[15] == pytest.approx(1.0)
    assert nearness[15] == pytest.approx(0.0, abs=1e-6)
    # Behind it sees the start and the wall 1 m behind that: 0.8 m of them are between the start's view and there.
    assert freshness[0] == pytest.approx(since(6), abs=1e-6)
    assert nearness[0] == pytest.approx(1 - 0.05 / 3.5, abs=0.02)


def test_a_bay_whose_end_was_seen_from_afar_is_known_without_having_been_entered() -> None:
    # A bay 1.5 m deep to the left of its way, closed at its end.
    bay = [(0.0, 2.5, 0.6, 0.05, 0.0), (-0.6, 1.75, 0.05, 0.8, 0.0), (0.6, 1.75, 0.05, 0.8, 0.0)]
    made = world(seen(sectors=30), *bay)
    made.reset(poses=(0.0, 0.0, 0.0), targets=(4.0, 3.0))
    left = 22  # 84 to 96 degrees
    freshness, nearness = made.robots.observations[0].reshape(2, 30)
    assert freshness[left] == pytest.approx(1.0)
    assert nearness[left] == pytest.approx(1 - 2.25 / 3.5, abs=0.02)
    # It drives on for 3 m, turns round, and comes by again with the bay on its right.
    drive(made, 60)
    drive(made, 15, 0.0, 1.0)
    drive(made, 1, 0.0, (math.pi - 3.0) / 0.2)
    drive(made, 60)
    right = 7  # -96 to -84 degrees
    freshness, nearness = made.robots.observations[0].reshape(2, 30)
    assert freshness[right] == pytest.approx(since(made.robots.views_kept[0] - 1), abs=1e-6)
    assert nearness[right] == pytest.approx(1 - 2.25 / 3.5, abs=0.02)  # nobody entered it


def test_progress_is_how_much_nearer_the_target_is_to_the_end_of_a_sight() -> None:
    # Behind it a wall at 2.5 m, nothing within 3.5 m where the other rays point, the target 5 m away straight ahead.
    made = world(seen(4, LidarConfig(rays=4, field_of_view=360.0), progress=True))
    made.reset(poses=(-2.5, 0.0, 0.0), targets=(2.5, 0.0))
    behind, aside = (5.0 - math.hypot(5.0 + 2.3, 0.0)) / 3.5, (5.0 - math.hypot(5.0, 3.3)) / 3.5
    assert made.robots.observations[0, 8:] == pytest.approx([behind, aside, 3.3 / 3.5, aside], abs=1e-5)


@pytest.mark.parametrize("lidar", LIDARS.values(), ids=LIDARS)
def test_it_is_what_the_plain_reference_sees(lidar: LidarConfig) -> None:
    noisy = OdometryConfig(distance_noise=0.05, heading_noise=0.05)
    complex_arena = ArenaConfig(name="complex")
    task = seen(24, lidar, progress=True, arena=complex_arena, odometry=noisy, step_limit=2000, arrival_distance=0.05)
    part = task.observation.parts[0]
    assert isinstance(part, KnownPart)
    made = World(task, NavigationVectorEnv(task, 1).arenas, 1, seed=3)
    made.reset()
    random, compared, old = np.random.default_rng(0), 0, 0
    robots = made.robots
    plain = PlainViews(task.lidar)
    for _ in range(400):
        believed = (robots.poses[0] + robots.drift[0]).astype(float)
        plain.keep(robots.ranges[0].astype(float), believed)
        expected = seen_known(
            plain.kept, robots.ranges[0].astype(float), believed, robots.targets[0].astype(float), part, task.lidar
        )
        # What lies on the edge of what a view showed falls on either side, and two readings are equally far.
        compared += bool((np.abs(robots.observations[0] - expected) < 1e-3).all())
        old += int(np.count_nonzero(expected[:24] < 0.9))
        made.step(np.array([[random.uniform(0.3, 1.0), random.uniform(-1.0, 1.0)]], np.float32))
        if robots.outcomes[0]:
            plain = PlainViews(task.lidar)
    assert compared > 390
    assert old > 1000


def test_the_oldest_views_are_forgotten() -> None:
    task = seen(step_limit=10_000)
    part = task.observation.parts[0]
    assert isinstance(part, KnownPart)
    made, plain = world(task), PlainViews(FULL)
    made.reset(poses=(0.0, 0.0, 0.0), targets=(4.5, 4.5))
    plain.keep(made.robots.ranges[0].astype(float), made.robots.poses[0].astype(float))
    for _ in range(3000):  # round and round: 150 m
        drive(made, 1, 1.0, 0.5)
        plain.keep(made.robots.ranges[0].astype(float), made.robots.poses[0].astype(float))
    assert made.robots.views_kept[0] > VIEW_ROOM
    robots = made.robots
    expected = seen_known(plain.kept, robots.ranges[0].astype(float), robots.poses[0].astype(float), (4.5, 4.5), part, FULL)
    assert made.robots.observations[0] == pytest.approx(expected, abs=0.02)
    assert 0.0 <= made.robots.observations[0].min() < 0.01


def test_a_new_target_and_a_new_episode_begin_anew() -> None:
    made = world(seen(arrival_distance=0.3))
    made.reset(poses=(-3.0, 0.0, 0.0), targets=(0.0, 0.0))
    while not made.robots.outcomes[0]:
        drive(made, 1)
    assert made.robots.views_kept[0] == 1  # an arrival
    while not made.robots.terminations[0]:
        drive(made, 1)
    assert made.robots.views_kept[0] == 1  # a wall
    assert made.robots.final_observations[0, :4].min() < 1.0


def test_a_training_goes_on_bit_for_bit() -> None:
    goes_on_bit_for_bit(KnownPart(frames=2))


def test_its_numbers_have_names_and_stay_in_their_ranges() -> None:
    layout = observation_layout(seen(6))
    assert [layout.numbers[k].name for k in (0, 5, 6, 11)] == [
        "known freshness 0",
        "known freshness 5",
        "known nearness 0",
        "known nearness 5",
    ]
    assert {(number.low, number.high) for number in layout.numbers} == {(0.0, 1.0)}
