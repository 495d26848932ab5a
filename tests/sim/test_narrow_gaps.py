"""Gaps that the body does not fit through: measured by hand, remembered from near by, and and what leads through them."""

import numpy as np
import pytest

from sim.arenas import Arena
from sim.config import LidarConfig, ObservationConfig, OpeningsPart, TaskConfig
from sim.engine.plain_narrow_gaps import PlainGaps, crosses
from sim.engine.plain_views import PlainView
from sim.engine.world import World
from sim.kernels.room import STRAIGHT_ON, THROUGH_GAP
from sim.kernels.views import FREE_SIGHT, SIGHT_THROUGH_GAP
from tests.sim.scenes import LIDARS


def world(gap: float, lidar: LidarConfig = LIDARS["full circle"]) -> World:
    """A room of 6 m with a wall across it at x = 0.5, and a gap around y = 0 in that."""
    length = (6.0 - gap) / 4.0
    boxes = [(0.5, side * (gap / 2.0 + length), 0.02, length, 0.0) for side in (1.0, -1.0)]
    parts = (OpeningsPart(count=1),)
    task = TaskConfig.model_validate({"lidar": lidar, "observation": ObservationConfig(parts=parts), "step_limit": 1000})
    return World(task, (Arena("room", 3.0, 3.0, boxes=np.array(boxes)),), 1, seed=0)


def drive(made: World, steps: int, linear: float = 1.0, angular: float = 0.0) -> None:
    for _ in range(steps):
        made.step(np.array([[linear, angular]], np.float32))


def ways_beyond_the_wall(made: World) -> set[int]:
    """How it gets to those openings that lie behind the wall and that were seen from before it."""
    robots = made.robots
    views, places = robots.opening_views[0], robots.opening_places[0]
    seen_from = robots.view_places[0, np.maximum(views, 0), 0]
    beyond = (views >= 0) & (places[:, 0] > 0.6) & (seen_from < 0.4)
    return set(robots.opening_access[0, beyond].tolist())


@pytest.mark.parametrize(
    ("begin", "end", "is_crossed"),
    [
        ((0.0, 0.0), (2.0, 0.0), True),
        ((2.0, 0.0), (0.0, 0.0), True),
        ((0.0, 0.0), (0.9, 0.0), False),
        ((0.0, 0.0), (2.0, 2.4), False),
        ((0.0, 0.0), (2.0, 1.6), True),
    ],
)
def test_a_line_that_closes_a_gap_is_crossed_between_its_ends(
    begin: tuple[float, float], end: tuple[float, float], is_crossed: bool
) -> None:
    assert crosses(begin, end, ((1.0, -1.0), (1.0, 1.0))) is is_crossed
    assert crosses(begin, end, ((1.0, 1.0), (1.0, -1.0))) is is_crossed


def test_a_width_is_taken_from_where_rays_end_less_what_lies_behind_the_posts_edges() -> None:
    # Posts 1 m away in directions 6 degrees to both sides of one ray: their ends are 2 sin 6 = 0.209 m apart. Each ray of 3
    # degrees ends up to 0.0524 m behind its post's edge, so 0.0524 m are taken off in all: 0.157 m.
    def gaps(near: float) -> list[tuple[tuple[float, float], tuple[float, float]]]:
        readings = np.full(120, 3.0)
        readings[[60, 64]] = 1.0
        return PlainGaps(near).measure(PlainView((0.0, 0.0), readings))

    assert gaps(0.157 / 2.25 - 0.001) == []
    ((one, other),) = gaps(0.157 / 2.25 + 0.001)
    # The line goes on for 0.1 m into both posts.
    assert np.hypot(*np.subtract(other, one)) == pytest.approx(2.0 * np.sin(np.radians(6.0)) + 0.2, abs=1e-6)


def test_a_gap_that_it_does_not_fit_through_is_closed_from_near_by_and_stays_so() -> None:
    made = world(0.4)
    made.reset(poses=(-2.2, 0.0, 0.0), targets=(2.5, 2.5))
    # From 2.7 m away it looks 0.38 m wide at least, which the body fits through.
    assert int(made.robots.gaps_found[0]) == 0
    assert STRAIGHT_ON in ways_beyond_the_wall(made)
    drive(made, 50)
    (_, one_y, _, other_y) = made.robots.gaps[0, 0].tolist()
    assert int(made.robots.gaps_found[0]) == 1
    assert sorted((one_y, other_y)) == pytest.approx([-0.3, 0.3], abs=0.09)
    assert ways_beyond_the_wall(made) == {THROUGH_GAP}
    assert made.robots.observations[0, 5] == 0.0
    drive(made, 16, 0.0, 1.0)  # to where it came from
    drive(made, 30)
    assert float(made.robots.poses[0, 0]) < -0.8
    assert ways_beyond_the_wall(made) <= {THROUGH_GAP}


def test_a_gap_that_it_fits_through_is_a_way() -> None:
    # 0.45 m are too narrow; from 1.6 m away 0.084 m are taken off. What is wider than both is never closed.
    made = world(0.56)
    made.reset(poses=(-2.2, 0.0, 0.0), targets=(2.5, 0.0))
    drive(made, 55)
    assert int(made.robots.gaps_found[0]) == 0
    assert FREE_SIGHT in made.robots.view_sights[0].tolist()
    assert made.robots.observations[0, 5] == 1.0


def test_a_target_that_is_seen_through_a_narrow_gap_is_not_in_free_sight_any_more() -> None:
    made = world(0.4)
    made.reset(poses=(-2.2, 0.0, 0.0), targets=(0.9, 0.0))
    assert made.robots.view_sights[0, 0] == FREE_SIGHT
    drive(made, 50)
    kept = int(made.robots.views_kept[0])
    assert set(made.robots.view_sights[0, :kept].tolist()) == {SIGHT_THROUGH_GAP}
    assert made.robots.observations[0, 5] == 0.0


def test_where_no_ray_points_there_is_no_post() -> None:
    # Half a circle of rays, from a place where the wall ends 0.3 m away and nothing else is near by.
    made = world(2.0, LIDARS["half"])
    made.reset(poses=(0.3, 0.9, -1.4), targets=(2.5, 0.0))
    assert int(made.robots.gaps_found[0]) == 0


def test_a_new_episode_knows_no_gaps() -> None:
    made = world(0.4)
    made.reset(poses=(-0.8, 0.0, 0.0), targets=(2.5, 0.0))
    assert int(made.robots.gaps_found[0]) == 1
    made.reset(poses=(-2.2, 0.0, 0.0), targets=(2.5, 0.0))
    assert int(made.robots.gaps_found[0]) == 0
