"""What a robot sees of the straight way to its target: numbers worked by hand, the plain reference, and every LiDAR."""

import numpy as np
import pytest

from sim.arenas import Arena
from sim.config import (
    ArenaConfig,
    LidarConfig,
    ObservationConfig,
    OdometryConfig,
    TaskConfig,
    WayPart,
)
from sim.engine.plain_way import seen_way
from sim.engine.world import World
from sim.envs.vector import NavigationVectorEnv
from tests.sim.scenes import LIDARS

FULL = LIDARS["full circle"]
SEES_WAY = ObservationConfig(parts=(WayPart(),))


def way(target: tuple[float, float], heading: float = 0.0, lidar: LidarConfig = FULL) -> list[float]:
    """What a robot in the middle of a room of 10 m sees, with a wall from x = 1.95 to 2.05, y = -1 to 1."""
    arena = Arena("room", 5.0, 5.0, boxes=np.array([[2.0, 0.0, 0.05, 1.0, 0.0]]))
    made = World(TaskConfig(lidar=lidar, observation=SEES_WAY), (arena,), 1, seed=0)
    made.reset(poses=(0.0, 0.0, heading), targets=target)
    seen: list[float] = made.robots.observations[0].tolist()
    return seen


@pytest.mark.parametrize("heading", [0.0, 2.0, -3.0])
def test_a_wall_in_the_way_is_seen_whatever_way_the_robot_faces(heading: float) -> None:
    # It would have arrived after 3.8 m, and the wall stands 1.95 m ahead.
    assert way((4.0, 0.0), heading) == pytest.approx([1.95 / 3.8, 0.0], abs=1e-4)


def test_the_way_is_free_up_to_where_the_robot_has_arrived() -> None:
    # The target is 0.1 m before the wall, which begins after 1.95 m: it has arrived after 1.65 m.
    assert way((1.85, 0.0)) == [1.0, 1.0]
    assert way((-2.0, 1.0)) == [1.0, 1.0]


def test_what_lies_beyond_the_range_is_not_known_to_be_free() -> None:
    assert way((-4.7, 0.0)) == pytest.approx([3.5 / 4.5, 0.0])


def test_where_it_has_arrived_nothing_is_left_to_be_free() -> None:
    assert way((0.1, 0.1)) == [1.0, 1.0]


def test_what_the_robot_would_pass_at_less_than_its_distance_is_in_the_way() -> None:
    # The nearest corner of the wall is at (1.95, 1): 0.26 m aside of the straight way to the first target, 0.17 m of that
    # to the second; a collision is at 0.2 m.
    assert way((2.6, 1.75))[1] == 1.0
    assert way((2.6, 1.6))[1] == 0.0


@pytest.mark.parametrize("lidar", LIDARS.values(), ids=LIDARS)
def test_it_is_what_the_plain_reference_sees(lidar: LidarConfig) -> None:
    task = TaskConfig(
        lidar=lidar,
        observation=SEES_WAY,
        arena=ArenaConfig(name="complex"),
        odometry=OdometryConfig(distance_noise=0.05, heading_noise=0.05),
        arrival_distance=0.05,
    )
    made = World(task, NavigationVectorEnv(task, 1).arenas, 1, seed=3)
    made.reset()
    random, told = np.random.default_rng(0), []
    robots = made.robots
    for _ in range(400):
        x, y, heading = (robots.poses[0] + robots.drift[0]).astype(float)
        dx, dy = robots.targets[0].astype(float) - (x, y)
        expected = seen_way(robots.ranges[0].astype(float), np.arctan2(dy, dx) - heading, float(np.hypot(dx, dy)), task)
        # What a ray meets at the edge of the way falls on either side of it.
        told.append(np.abs(robots.observations[0] - expected).max())
        made.step(np.array([[random.uniform(0.3, 1.0), random.uniform(-1.0, 1.0)]], np.float32))
    assert np.count_nonzero(np.array(told) > 1e-3) <= 2
