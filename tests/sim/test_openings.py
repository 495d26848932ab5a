"""Openings to look into: numbers worked by hand, the plain reference, every LiDAR, and what forgets them."""

import math

import numpy as np
import pytest

from sim.arenas import Arena
from sim.arrays import Floats
from sim.config import LidarConfig, ObservationConfig, OdometryConfig, OpeningsPart, TaskConfig
from sim.engine.plain_openings import PlainOpenings
from sim.engine.plain_views import PlainViews
from sim.engine.world import World
from sim.envs.vector import NavigationVectorEnv
from sim.kernels.room import STRAIGHT_ON, VIEW_ROOM
from sim.kernels.walls import count_walls
from sim.observations import near_distance, observation_layout
from tests.sim.scenes import LIDARS, goes_on_bit_for_bit

FULL = LIDARS["full circle"]


def looking(count: int = 2, lidar: LidarConfig = FULL, **task: object) -> TaskConfig:
    parts = (OpeningsPart(count=count),)
    return TaskConfig.model_validate({"lidar": lidar, "observation": ObservationConfig(parts=parts), **task})


def world(task: TaskConfig, *boxes: tuple[float, ...], half: float = 5.0) -> World:
    arena = Arena("room", half, half, boxes=np.array(boxes) if boxes else np.empty((0, 5)))
    return World(task, (arena,), 1, seed=0)


def drive(made: World, steps: int, linear: float = 1.0, angular: float = 0.0) -> None:
    for _ in range(steps):
        made.step(np.array([[linear, angular]], np.float32))


def leads(made: World) -> Floats:
    told: Floats = made.robots.observations[0].reshape(-1, 6)
    return told


def bearing_of_the_first(made: World) -> float:
    """Degrees."""
    return math.degrees(math.atan2(*leads(made)[0, :2].tolist()))


def wall_with_gap(x: float, gap: float) -> list[tuple[float, ...]]:
    """A wall across a room of 3 m, with a gap around its middle."""
    length = (3.0 - gap) / 2.0
    return [(x, side * (gap + length) / 2.0, 0.02, length / 2.0, 0.0) for side in (1.0, -1.0)]


def test_in_the_open_it_is_told_where_its_sight_ends_nearest_to_the_target() -> None:
    made = world(looking())
    made.reset(poses=(0.0, 0.0, 0.0), targets=(4.0, 3.0))
    # Nothing within 3.5 m: an opening there every 30 degrees, from -166.5 on. The target is in the direction of 36.9.
    for told, degrees in zip(leads(made), (43.5, 13.5), strict=True):
        angle = math.radians(degrees)
        rest = math.dist((4.0, 3.0), (3.5 * math.cos(angle), 3.5 * math.sin(angle)))
        expected = [math.sin(angle), math.cos(angle), 0.0, 3.5 / 4.5, rest / (rest + 1.0), 1.0]
        assert told == pytest.approx(expected, abs=1e-5)


def place_of_the_first(made: World) -> tuple[float, float]:
    """Metres ahead and to the left."""
    sine, cosine, nearness = leads(made)[0, :3].tolist()
    away = (1.0 - nearness) * made.task.lidar.range
    return away * cosine, away * sine


def test_a_gap_that_the_body_fits_through_is_an_opening_half_way_behind_its_edge() -> None:
    made = world(looking(1), *wall_with_gap(0.5, 0.6), half=1.5)
    made.reset(poses=(-0.5, 0.0, 0.0), targets=(1.2, 1.2))
    # Rays every 3 degrees: the one at 18 meets the wall after 0.98 m / cos 18, the one at 15 the wall behind it after
    # 2 m / cos 15. The opening is half way between these ends, in the direction between those that a view keeps.
    away = (0.98 / math.cos(math.radians(18.0)) + 2.0 / math.cos(math.radians(15.0))) / 2.0
    sine, cosine = math.sin(math.radians(15.0)), math.cos(math.radians(15.0))
    rest = math.dist((-0.5 + away * cosine, away * sine), (1.2, 1.2))
    assert leads(made)[0, 3:] == pytest.approx([away / (away + 1.0), rest / (rest + 1.0), 1.0], abs=3e-3)
    # It goes to its gate first. The post on the other side is seen 0.64 m away, which is more than 3 times 0.2 m: the gate
    # is half of these 0.6 m beside the edge, which a view keeps in the direction of 16.5.
    edge = 0.98 / math.cos(math.radians(18.0))
    gate = edge * math.cos(math.radians(16.5)) + 0.3 * sine, edge * math.sin(math.radians(16.5)) - 0.3 * cosine
    assert place_of_the_first(made) == pytest.approx(gate, abs=8e-3)


def test_the_gate_of_a_narrow_gap_is_half_way_between_its_posts() -> None:
    made = world(looking(1), *wall_with_gap(0.5, 0.5), half=1.5)
    made.reset(poses=(-0.5, 0.0, 0.0), targets=(1.2, 1.2))
    # Rays at 15 and -15 degrees meet the posts after 0.98 m / cos 15; a view keeps them at 13.5 and -16.5, 0.53 m apart.
    away = 0.98 / math.cos(math.radians(15.0))
    left, right = math.radians(13.5), math.radians(-16.5)
    gate = away * (math.cos(left) + math.cos(right)) / 2.0, away * (math.sin(left) + math.sin(right)) / 2.0
    assert place_of_the_first(made) == pytest.approx(gate, abs=8e-3)
    # Where it is 0.15 m away from there it goes on to what lies behind the edge.
    drive(made, 17)
    beyond = place_of_the_first(made)
    assert beyond[0] > 0.5
    assert beyond[1] > 0.1


def test_what_was_seen_through_a_gap_that_is_too_narrow_is_an_opening_elsewhere() -> None:
    # Behind a wall with a gap of 0.4 m in its middle, and a way round its end.
    pieces = [(0.5, 0.6, 0.02, 0.4, 0.0), (0.5, -1.6, 0.02, 1.4, 0.0)]
    made = world(looking(3), *pieces, half=3.0)
    made.reset(poses=(-0.4, 0.0, 0.0), targets=(2.8, 0.0))
    assert int(made.robots.gaps_found[0]) == 1
    drive(made, 16, 0.0, 0.5)
    drive(made, 40)
    robots = made.robots
    seen_from = robots.view_places[0, np.maximum(robots.opening_views[0], 0)]
    beyond = (robots.opening_views[0] > 0) & (robots.opening_places[0, :, 0] > 0.6) & (seen_from[:, 1] > 0.5)
    assert STRAIGHT_ON in robots.opening_access[0, beyond]


def test_a_gap_that_the_body_does_not_fit_through_is_none() -> None:
    made = world(looking(1), *wall_with_gap(0.5, 0.28), half=1.5)
    made.reset(poses=(-0.5, 0.0, 0.0), targets=(1.2, 1.2))
    assert leads(made)[0].tolist() == [0.0] * 6


@pytest.mark.parametrize(("gap", "is_free"), [(0.6, 1.0), (0.28, 0.0)])
def test_a_target_in_sight_is_told_with_whether_the_body_can_go_there_straight_on(gap: float, is_free: float) -> None:
    made = world(looking(1), *wall_with_gap(0.5, gap), half=1.5)
    made.reset(poses=(-0.5, 0.0, 0.0), targets=(1.2, 0.0))
    assert leads(made)[0] == pytest.approx([0.0, 1.0, 1.0 - 1.7 / 3.5, 1.7 / 2.7, 0.0, is_free], abs=1e-5)


def test_a_wall_that_was_seen_between_an_opening_and_the_target_is_a_detour_of_4_metres() -> None:
    # The way out of a room 1.8 m wide is a gap to its left; the target lies 0.3 m behind the wall to its right.
    made = world(looking(1), *wall_with_gap(-0.8, 0.6), (1.0, 0.0, 0.02, 1.5, 0.0), half=1.5)
    made.reset(poses=(0.0, 0.3, 0.0), targets=(1.3, -0.2))
    (*_, rest, is_free) = leads(made)[0].tolist()
    (x, y) = made.robots.leads[0, 0, :2].tolist()
    straight = math.dist((x, y), (1.3, -0.2))
    assert x < 0.0
    assert is_free == 1.0
    assert rest / (1.0 - rest) == pytest.approx(straight + 4.0, abs=0.01)
    drive(made, 20, 0.3, 0.2)
    # It is one wall however often it is seen.
    assert 4.0 < leads(made)[0, 4] / (1.0 - leads(made)[0, 4]) < straight + 4.5


def test_a_pillar_is_no_wall() -> None:
    made = world(looking(1), (1.0, 0.0, 0.1, 0.1, 0.0), half=1.5)
    made.reset(poses=(0.0, 0.0, 0.0), targets=(1.3, 0.0))
    (*_, rest, _) = leads(made)[0].tolist()
    assert 0.0 < rest / (1.0 - rest) < 0.5


def test_one_that_it_comes_no_nearer_to_falls_behind() -> None:
    made = world(looking())
    made.reset(poses=(0.0, 0.0, 0.0), targets=(4.0, 3.0))
    # As in the open above: by the second one the target is 0.69 m farther away. After 16 steps the first one's way was never
    # longer; from then on it counts 0.64 m farther for every 16.
    bearings = []
    for _ in range(3):
        drive(made, 15, 0.0)
        bearings.append(bearing_of_the_first(made))
        drive(made, 1, 0.0)
        bearings.append(bearing_of_the_first(made))
    assert bearings == pytest.approx([43.5] * 5 + [13.5], abs=1e-3)
    # Elsewhere it is as patient as before.
    made.reset(poses=(0.0, 0.0, 0.0), targets=(4.0, 3.0))
    drive(made, 40, 0.0)
    assert bearing_of_the_first(made) == pytest.approx(43.5, abs=1e-3)


def test_pieces_of_a_line_side_by_side_are_crossed_by_one_wall() -> None:
    assert [count_walls(crossed) for crossed in (0b0, 0b1, 0b110, 0b1011001, 1 << 59)] == [0, 1, 1, 3, 1]


def test_what_another_view_showed_is_no_opening_any_more() -> None:
    made = world(looking(1), *wall_with_gap(0.0, 1.0), half=1.5)
    made.reset(poses=(-1.0, -1.2, 0.0), targets=(1.3, 1.3))
    assert leads(made)[0, 5] == 1.0
    made.reset(poses=(-0.7, 0.0, 0.0), targets=(1.3, 1.3))
    before = int((made.robots.opening_views[0] >= 0).sum())
    drive(made, 30)
    # It stands 1.5 m farther on, in the other half, and has looked into its corners.
    assert before > 0
    assert int((made.robots.opening_views[0] >= 0).sum()) == 0


def test_a_target_that_it_saw_is_found_again_by_the_way_it_came() -> None:
    # The wall begins at x = -0.5, and from there on hides the target from who drives along it.
    made = world(looking(1), (2.25, 0.6, 2.75, 0.05, 0.0))
    made.reset(poses=(-2.0, 0.0, 0.0), targets=(-1.0, 2.0))
    assert leads(made)[0, 4:].tolist() == [0.0, 1.0]
    drive(made, 80)
    # Views every half metre up to x = 2. The one at -1 saw the target 2 m away, and is itself 3 m behind it and in sight.
    assert leads(made)[0] == pytest.approx([0.0, -1.0, 1.0 - 3.0 / 3.5, 5.0 / 6.0, 0.0, 1.0], abs=1e-3)


def test_the_way_back_is_by_views_that_are_in_sight_of_one_another() -> None:
    # Along a wall, round its end at x = 1.5, and back on its other side, up to another one that closes that way.
    made = world(looking(1), (-1.75, 0.0, 3.25, 0.05, 0.0), (-0.6, 2.5, 0.05, 2.5, 0.0))
    made.reset(poses=(-1.0, -0.6, 0.0), targets=(-2.0, -2.5))
    assert leads(made)[0, 4:].tolist() == [0.0, 1.0]
    for straight_on in (60, 24, 40):
        drive(made, straight_on)
        x, y, heading = made.robots.poses[0].tolist()
        (sine, cosine, nearness, way, rest, _) = leads(made)[0].tolist()
        drive(made, 7, 0.0, 1.0)
        drive(made, 1, 0.0, (math.pi / 2.0 - 1.4) / 0.2)
    assert (x, y) == pytest.approx((0.0, 0.6), abs=0.01)
    # To its target, which lies behind both walls, it goes first to a view round the wall's end, and farther than round that.
    assert rest == 0.0
    away, towards = (1.0 - nearness) * 3.5, heading + math.atan2(sine, cosine)
    assert x + away * math.cos(towards) > 1.5
    end = (1.5, 0.0)
    assert way / (1.0 - way) > math.dist((x, y), end) + math.dist(end, (-2.0, -2.5))


def test_a_new_target_and_a_new_episode_begin_anew() -> None:
    made = world(looking(arrival_distance=0.3))
    made.reset(poses=(-3.0, 0.0, 0.0), targets=(0.0, 0.0))
    while not made.robots.outcomes[0]:
        drive(made, 1)
    # An arrival: all that it knows is seen from here.
    assert made.robots.views_kept[0] == 1
    assert set(made.robots.opening_views[0].tolist()) == {-1, 0}
    while not made.robots.terminations[0]:
        drive(made, 1)
    assert made.robots.views_kept[0] == 1  # a wall
    assert set(made.robots.opening_views[0].tolist()) == {-1, 0}


def test_the_oldest_views_are_forgotten_with_their_openings() -> None:
    task = looking(3, step_limit=10_000)
    made, views = world(task, (0.0, 3.0, 0.5, 0.5, 0.3)), PlainViews(FULL)
    plain, part = PlainOpenings(FULL, near_distance(task), views), task.observation.parts[0]
    assert isinstance(part, OpeningsPart)
    made.reset(poses=(0.0, 0.0, 0.3), targets=(4.5, 4.5))
    robots, agreed = made.robots, 0
    for step in range(3000):  # round and round: 150 m
        believed = robots.poses[0].astype(float)
        plain.follow(step, (4.5, 4.5), is_kept=views.keep(robots.ranges[0].astype(float), believed))
        if step > 2900:
            expected = plain.seen(robots.ranges[0].astype(float), believed, part)
            agreed += bool((np.abs(robots.observations[0] - expected) < 1e-3).all())
        drive(made, 1, 1.0, 0.5)
    assert robots.views_kept[0] > VIEW_ROOM
    assert agreed > 90


def test_a_training_goes_on_bit_for_bit() -> None:
    goes_on_bit_for_bit(OpeningsPart(frames=2))


def test_its_numbers_have_names_and_stay_in_their_ranges() -> None:
    layout = observation_layout(looking(2))
    assert [number.name for number in layout.numbers[:6]] == [
        "opening 0, sine of bearing",
        "opening 0, cosine of bearing",
        "opening 0, nearness",
        "opening 0, way",
        "opening 0, rest",
        "opening 0, free",
    ]
    assert [number.low for number in layout.numbers] == [-1.0, -1.0, 0.0, 0.0, 0.0, 0.0] * 2


@pytest.mark.parametrize("arena", ["complex", "maze"])
@pytest.mark.parametrize("lidar", LIDARS.values(), ids=LIDARS)
def test_it_is_what_the_plain_reference_sees(lidar: LidarConfig, arena: str) -> None:
    noisy = OdometryConfig(distance_noise=0.05, heading_noise=0.05)
    config = {"name": arena} if arena == "complex" else {"name": arena, "difficulty": 1.0, "maps": 1, "seed": 0}
    task = looking(3, lidar, arena=config, odometry=noisy, step_limit=2000, arrival_distance=0.05)
    part = task.observation.parts[0]
    assert isinstance(part, OpeningsPart)
    made = World(task, NavigationVectorEnv(task, 1).arenas, 1, seed=3)
    made.reset()
    random, agreed, told = np.random.default_rng(0), 0, 0
    robots = made.robots

    def begin() -> tuple[PlainViews, PlainOpenings]:
        views = PlainViews(task.lidar)
        return views, PlainOpenings(task.lidar, near_distance(task), views)

    views, plain = begin()
    for _ in range(400):
        believed = (robots.poses[0] + robots.drift[0]).astype(float)
        scan, (x, y) = robots.ranges[0].astype(float), robots.targets[0].tolist()
        plain.follow(int(robots.records["steps"][0]), (x, y), is_kept=views.keep(scan, believed))
        expected = plain.seen(scan, believed, part)
        agreed += bool((np.abs(robots.observations[0] - expected) < 1e-3).all())
        told += int(np.count_nonzero(expected[::6]))
        made.step(np.array([[random.uniform(0.3, 1.0), random.uniform(-1.0, 1.0)]], np.float32))
        if robots.outcomes[0]:
            views, plain = begin()
    assert agreed > 390
    assert told > 200
