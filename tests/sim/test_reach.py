"""How far a robot sees that it could go in each direction: numbers worked by hand, the plain reference, and every LiDAR."""

import numpy as np
import pytest
from numpy.typing import NDArray

from sim.arenas import Arena
from sim.config import ArenaConfig, LidarConfig, ObservationConfig, OdometryConfig, ReachPart, TaskConfig
from sim.engine.plain_reach import seen_reach
from sim.engine.world import World
from sim.envs.vector import NavigationVectorEnv
from tests.sim.scenes import LIDARS

FINE = LidarConfig(rays=360, field_of_view=360.0)
FREE = 0.2 / (0.2 + 3.5)


def reach(*boxes: tuple[float, ...], heading: float = 0.0, sectors: int = 12, task: TaskConfig | None = None) -> list[float]:
    """What a robot in the middle of a room of 10 m sees, between boxes."""
    arena = Arena("room", 5.0, 5.0, boxes=np.array(boxes).reshape(-1, 5))
    task = task or TaskConfig(lidar=FINE)
    observation = ObservationConfig(parts=(ReachPart(sectors=sectors),))
    made = World(task.model_copy(update={"observation": observation}), (arena,), 1, seed=0)
    made.reset(poses=(0.0, 0.0, heading), targets=(4.0, 4.0))
    seen: list[float] = made.robots.observations[0].tolist()
    return seen


def test_in_the_open_every_direction_is_as_far_as_the_lidar_reaches() -> None:
    assert reach() == pytest.approx([FREE] * 12)


def test_a_wall_is_reached_a_body_before_it_stands() -> None:
    # Its face is 1 m ahead, to the robot's left where it turns right by a quarter: straight at it 0.8 m are left. Sectors
    # have 30 degrees, so what is told of the two beside the middle is how far it comes at 22.5 + 3.75 degrees.
    wall = (1.1, 0.0, 0.1, 3.0, 0.0)
    aside = np.deg2rad(26.25)
    farthest = 0.2 / (0.2 + 0.8 / np.cos(aside))
    assert reach(wall)[5:7] == pytest.approx([farthest] * 2, rel=1e-3)
    assert reach(wall, heading=-np.pi / 2)[8:10] == pytest.approx([farthest] * 2, rel=1e-3)
    assert reach(wall)[0] == pytest.approx(FREE)


@pytest.mark.parametrize(("gap", "fits"), [(0.38, False), (0.44, True)])
def test_a_gap_is_open_where_the_body_fits_through(gap: float, fits: bool) -> None:
    # A wall 0.1 m thick, 1 m ahead; a collision is at 0.2 m on either side.
    walls = [(1.05, side * (gap / 2 + 1.5), 0.05, 1.5, 0.0) for side in (-1.0, 1.0)]
    ahead = min(reach(*walls, sectors=60)[29:31])
    assert ahead == pytest.approx(FREE, rel=1e-3) if fits else ahead > 0.2 / (0.2 + 1.0)


def test_along_a_wall_it_may_go_anywhere_but_into_it() -> None:
    # The wall is 0.15 m to its left, the body's radius 0.105 m. Of a quarter's four directions those along the wall, 11.25
    # degrees towards it, lead farthest.
    seen = reach((0.0, 0.25, 4.0, 0.1, 0.0), sectors=4, task=TaskConfig(lidar=FINE, collision_distance=0.1))
    free, along_it = 0.105 / (0.105 + 3.5), 0.105 / (0.105 + 0.045 / np.sin(np.deg2rad(11.25)))
    assert seen == pytest.approx([free, free, along_it, along_it], rel=5e-3)


def test_what_touches_it_leaves_it_the_way_away() -> None:
    # The wall is 0.15 m to its left, and a collision would have been at 0.2 m.
    task = TaskConfig(lidar=FINE, collision_distance=0.1)
    ranges = np.where(np.arange(360) == 270, 0.05, 3.5)  # one reading, straight to the left
    part = ReachPart(sectors=4)
    seen = seen_reach(ranges, 0.0, 4.0, part, task.model_copy(update={"observation": ObservationConfig(parts=(part,))}))
    assert seen == pytest.approx([0.105 / 3.605] * 2 + [1.0] * 2)


@pytest.mark.parametrize("lidar", LIDARS.values(), ids=LIDARS)
def test_it_is_what_the_plain_reference_sees(lidar: LidarConfig) -> None:
    part = ReachPart(sectors=24, progress=True)
    task = TaskConfig(
        lidar=lidar,
        observation=ObservationConfig(parts=(part,)),
        arena=ArenaConfig(name="complex"),
        odometry=OdometryConfig(distance_noise=0.05, heading_noise=0.05),
        arrival_distance=0.05,
    )
    made = World(task, NavigationVectorEnv(task, 1).arenas, 1, seed=3)
    made.reset()
    random = np.random.default_rng(0)
    differ, told = 0, []
    robots = made.robots
    for _ in range(400):
        x, y, heading = robots.poses[0] + robots.drift[0]
        dx, dy = robots.targets[0] - (x, y)
        bearing, distance = np.arctan2(dy, dx) - heading, np.hypot(dx, dy)
        expected: NDArray[np.float64] = seen_reach(robots.ranges[0].astype(float), bearing, distance, part, task)
        # A direction that passes a reading's end at the very distance of a collision falls on either side.
        differ += int(np.count_nonzero(np.abs(robots.observations[0] - expected) > 1e-3))
        told.append(expected)
        made.step(np.array([[random.uniform(0.3, 1.0), random.uniform(-1.0, 1.0)]], np.float32))
    assert differ <= 4
    assert np.ptp(told) > 0.5


def test_progress_is_how_much_nearer_the_target_would_be() -> None:
    # Free all around, the target 5 m away: straight at it would be all of the range. Of a sector's four directions that
    # nearest to the target is told.
    observation = ObservationConfig(parts=(ReachPart(sectors=12, progress=True),))
    made = World(TaskConfig(lidar=FINE, observation=observation), (Arena("room", 9.0, 9.0),), 1, seed=0)
    made.reset(poses=(0.0, 0.0, np.pi / 2), targets=(3.0, 4.0))
    bearing = np.arctan2(4.0, 3.0) - np.pi / 2
    progress = made.robots.observations[0, 12:]
    for sector in range(12):
        aside = np.deg2rad(30.0 * sector - 180.0 + np.array([3.75, 11.25, 18.75, 26.25])) - bearing
        # The third side of a triangle of 5 m and 3.5 m.
        left = np.sqrt(25.0 + 3.5**2 - 2 * 5.0 * 3.5 * np.cos(aside)).min()
        assert progress[sector] == pytest.approx((5.0 - left) / 3.5, abs=1e-5)
    assert progress.argmax() == 4, "37 degrees to its right"
    assert progress.max() > 0.99


def test_behind_a_wall_progress_ends_before_it() -> None:
    # The face is 1 m ahead: 0.8 m are left, or a little more aside of the middle, to a target 4 m straight ahead.
    observation = ObservationConfig(parts=(ReachPart(sectors=60, progress=True),))
    wall = Arena("room", 5.0, 5.0, boxes=np.array([(1.1, 0.0, 0.1, 3.0, 0.0)]))
    made = World(TaskConfig(lidar=FINE, observation=observation), (wall,), 1, seed=0)
    made.reset(poses=(0.0, 0.0, 0.0), targets=(4.0, 0.0))
    ahead = made.robots.observations[0, 60 + 29 : 60 + 31]
    assert ahead == pytest.approx([0.8 / 3.5] * 2, abs=2e-3)


def test_a_state_that_was_kept_with_the_reach_goes_on_without() -> None:
    task = TaskConfig(observation=ObservationConfig(parts=(ReachPart(sectors=4),)))
    first, second = (NavigationVectorEnv(task, 3, seed=1) for _ in range(2))
    first.reset()
    assert "reach" not in first.get_state(), "it is worked out anew in every step"
    second.set_state(first.get_state() | {"reach": np.zeros((3, 16))})
    action = np.full((3, 2), 0.5, np.float32)
    assert np.array_equal(first.step(action)[0], second.step(action)[0])
