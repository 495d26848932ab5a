"""What makes a robot's life harder: a poor LiDAR, drifting odometry, late commands, limits of acceleration, and all of it
drawn anew for every episode.
"""

from itertools import pairwise

import numpy as np
import pytest

from sim.config import (
    ArenaConfig,
    BurgerConfig,
    LidarConfig,
    ObservationConfig,
    ObservationName,
    OdometryConfig,
    RandomisationConfig,
    RewardConfig,
    TaskConfig,
)
from sim.engine.plain import exact_arc
from sim.envs.vector import NavigationVectorEnv
from sim.kernels.records import QUANTITIES
from sim.scan import scan

COMPLEX = ArenaConfig(name="complex")


def test_noise_is_normal_with_the_asked_deviation_and_spares_rays_that_hit_nothing() -> None:
    task = TaskConfig(arena=COMPLEX, lidar=LidarConfig(noise=0.03))
    envs = NavigationVectorEnv(task, 2000, seed=0)
    envs.reset()
    true = scan(envs.arenas[0], envs.poses, task.lidar)
    hits = (true < 3.3) & (true > 0.2)
    error = (envs.ranges - true)[hits]
    assert error.mean() == pytest.approx(0.0, abs=1e-3)
    assert error.std() == pytest.approx(0.03, rel=0.02)
    assert np.mean(np.abs(error) < 0.03) == pytest.approx(0.683, abs=0.01)
    assert np.array_equal(envs.ranges[true >= 3.5], true[true >= 3.5])
    assert 0.0 <= envs.ranges.min() <= envs.ranges.max() <= 3.5


def test_a_dropped_ray_reads_the_full_range() -> None:
    task = TaskConfig(arena=COMPLEX, lidar=LidarConfig(dropout=0.25))
    envs = NavigationVectorEnv(task, 2000, seed=0)
    envs.reset()
    true = scan(envs.arenas[0], envs.poses, task.lidar)
    hits = true < 3.5
    dropped = envs.ranges[hits] == 3.5
    assert dropped.mean() == pytest.approx(0.25, abs=0.01)
    assert np.allclose(envs.ranges[hits][~dropped], true[hits][~dropped], atol=1e-6)


def test_collisions_are_judged_by_the_world_and_not_by_the_noisy_scan() -> None:
    # 0.3 m of noise on ranges of 0.7 m: every third scan or so has a reading below 0.2 m, yet nothing is touched.
    task = TaskConfig(lidar=LidarConfig(noise=0.3))
    envs = NavigationVectorEnv(task, 200, seed=0)
    envs.reset(options={"poses": [4.3, 0.0, 0.0], "targets": [-3.0, 0.0]})
    for _ in range(20):
        envs.step(np.zeros((200, 2), dtype=np.float32))
        assert not envs.outcomes.any()
    assert (envs.ranges.min(axis=1) < 0.2).mean() > 0.05


def test_noise_does_not_break_the_independence_of_robots() -> None:
    task = TaskConfig(arena=COMPLEX, lidar=LidarConfig(noise=0.02, dropout=0.1))
    many, few = (NavigationVectorEnv(task, n, seed=4) for n in (50, 2))
    many.reset()
    few.reset()
    actions = np.random.default_rng(0).uniform([0.0, -1.0], 1.0, (100, 50, 2)).astype(np.float32)
    for action in actions:
        ours, theirs = many.step(action)[0], few.step(action[:2])[0]
        assert np.array_equal(ours[:2], theirs)


def test_velocities_change_no_faster_than_the_limits_of_acceleration() -> None:
    # 0.25 m/s² for 0.2 s is 0.05 m/s, a fifth of the top speed; 2 rad/s² is 0.4 of the top turning rate.
    robot = BurgerConfig(max_linear_acceleration=0.25, max_angular_acceleration=2.0)
    envs = NavigationVectorEnv(TaskConfig(robot=robot), 1, seed=0)
    envs.reset(options={"poses": [0.0, 0.0, 0.0], "targets": [3.0, 0.0]})
    seen = []
    for action in ([1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [0.0, -1.0]):
        observation, *_ = envs.step(np.array([action], dtype=np.float32))
        seen.append(observation[0, 10:12].tolist())
    assert np.array(seen) == pytest.approx(np.array([[0.2, 0.4], [0.4, 0.8], [0.6, 0.4], [0.4, 0.0]]), abs=1e-6)
    # The way driven is that of the velocities reached, not of those asked for.
    assert envs.attempt_path_lengths[0] == pytest.approx(0.05 * (0.2 + 0.4 + 0.6 + 0.4), rel=1e-6)


def test_a_slow_scanner_shows_the_same_scan_until_the_next_one_is_there() -> None:
    # 2 scans a second and 5 actions: every third action (0.5 s / 0.2 s, rounded) has a new scan.
    task = TaskConfig(lidar=LidarConfig(rate=2.0, noise=0.01))
    envs = NavigationVectorEnv(task, 20, seed=0)
    envs.reset(options={"poses": [2.5, 0.0, 0.0], "targets": [-3.0, 0.0]})
    scans = [envs.ranges.copy()]
    for _ in range(8):
        envs.step(np.tile(np.array([[0.3, 0.3]], dtype=np.float32), (20, 1)))
        scans.append(envs.ranges.copy())
    assert not envs.outcomes.any()
    new = [not np.array_equal(one, other) for one, other in pairwise(scans)]
    assert new == [False, False, True, False, False, True, False, False]
    assert np.abs(scans[3] - scan(envs.arenas[0], pose_after(3), task.lidar)).max() < 0.06


def pose_after(steps: int) -> np.ndarray:
    """Where the robot of the test above is: 0.015 m and 0.06 rad a step."""
    x, y, heading = exact_arc((2.5, 0.0, 0.0), 0.075, 0.3, 0.2 * steps)
    return np.array([[x, y, heading]])


def test_a_held_scan_does_not_hide_a_collision() -> None:
    task = TaskConfig(lidar=LidarConfig(rate=0.5))
    envs = NavigationVectorEnv(task, 1, seed=0)
    envs.reset(options={"poses": [4.72, 0.0, 0.0], "targets": [-3.0, 0.0]})
    envs.step(np.array([[1.0, 0.0]], dtype=np.float32))
    envs.step(np.array([[1.0, 0.0]], dtype=np.float32))  # 0.18 m from the wall, seen from 0.28 m
    assert envs.outcomes[0] == 2


def test_odometry_drifts_with_the_way_and_the_turn_and_only_the_observation_believes_it() -> None:
    task = TaskConfig(odometry=OdometryConfig(distance_noise=0.1, heading_noise=0.2), step_limit=1000)
    envs = NavigationVectorEnv(task, 4000, seed=0)
    placed = {"poses": [-2.0, 0.0, 0.0], "targets": [3.0, 0.0]}
    envs.reset(options=placed)
    for _ in range(40):  # 2 m straight on: the position is off by 0.1 m times the root of 2, the heading by nothing
        observations = envs.step(np.tile(np.array([[1.0, 0.0]], dtype=np.float32), (4000, 1)))[0]
    believed = 1.0 / (1.0 - observations[:, 12].astype(float)) - 1.0
    assert believed.mean() == pytest.approx(3.0, abs=0.01)
    assert believed.std() == pytest.approx(0.1 * np.sqrt(2.0), rel=0.05)
    assert np.array_equal(observations[:, 14], np.zeros(4000, dtype=np.float32))
    assert np.abs(envs.poses - [0.0, 0.0, 0.0]).max() < 1e-5
    assert not envs.outcomes.any()

    envs.reset(options=placed)
    for _ in range(10):  # 2 rad on the spot
        observations = envs.step(np.tile(np.array([[0.0, 1.0]], dtype=np.float32), (4000, 1)))[0]
    heading = observations[:, 14] * np.pi
    assert heading.mean() == pytest.approx(2.0, abs=0.02)
    assert heading.std() == pytest.approx(0.2 * np.sqrt(2.0), rel=0.05)


def test_with_a_new_target_odometry_starts_from_the_true_pose() -> None:
    task = TaskConfig(odometry=OdometryConfig(distance_noise=0.3, heading_noise=0.3))
    envs = NavigationVectorEnv(task, 300, seed=0)
    envs.reset(options={"poses": [0.0, 0.0, 0.0], "targets": [0.32, 0.0]})
    for _ in range(3):  # 0.17 m: arrived, whatever the robot believes
        observations = envs.step(np.tile(np.array([[1.0, 0.1]], dtype=np.float32), (300, 1)))[0]
    assert (envs.outcomes == 1).all()
    distance = np.hypot(*(envs.targets - envs.poses[:, :2]).T)
    assert observations[:, 12] == pytest.approx(distance / (distance + 1.0), abs=1e-6)
    assert observations[:, 14] * np.pi == pytest.approx(envs.poses[:, 2], abs=1e-6)


@pytest.mark.parametrize("observation", ["paper", "improved"])
def test_observations_stay_within_their_bounds_however_far_odometry_drifts(observation: ObservationName) -> None:
    task = TaskConfig(
        observation=ObservationConfig.preset(observation), odometry=OdometryConfig(distance_noise=0.5, heading_noise=0.5)
    )
    envs = NavigationVectorEnv(task, 200, seed=0)
    envs.reset()
    for action in np.random.default_rng(0).uniform([0.5, -1.0], 1.0, (300, 200, 2)).astype(np.float32):
        assert envs.observation_space.contains(envs.step(action)[0])


def test_a_command_is_followed_as_late_as_asked() -> None:
    envs = NavigationVectorEnv(TaskConfig(command_delay=2), 1, seed=0)
    envs.reset(options={"poses": [0.0, 0.0, 0.0], "targets": [3.0, 0.0]})
    driven = []
    for linear in (0.2, 0.4, 0.6, 0.8, 1.0):
        observation, *_ = envs.step(np.array([[linear, 0.0]], dtype=np.float32))
        driven.append(float(observation[0, 10]))
    assert driven == pytest.approx([0.0, 0.0, 0.2, 0.4, 0.6])
    assert envs.poses[0, 0] == pytest.approx(0.05 * 1.2, abs=1e-6)
    # A new episode begins with an empty queue.
    envs.reset(options={"poses": [0.0, 0.0, 0.0], "targets": [3.0, 0.0]})
    observation, *_ = envs.step(np.array([[1.0, 0.0]], dtype=np.float32))
    assert observation[0, 10] == 0.0


EVERYTHING = TaskConfig(
    arena=COMPLEX,
    step_limit=20,
    randomisation=RandomisationConfig(
        range=(1.0, 3.0),
        rate=(2.0, 20.0),
        noise=(0.0, 0.03),
        dropout=(0.0, 0.2),
        distance_noise=(0.0, 0.1),
        heading_noise=(0.05, 0.1),
        command_delay=(0, 3),
        max_linear_speed=(0.2, 0.3),
        max_angular_speed=(0.8, 1.2),
        field_of_view=(140.0, 200.0),
    ),
)


def test_every_quantity_is_drawn_uniformly_and_anew_for_every_episode() -> None:
    envs = NavigationVectorEnv(EVERYTHING, 3000, seed=0)
    envs.reset()
    drawn = envs._world.robots.drawn
    first = drawn.copy()
    for name, column in zip(QUANTITIES, first.T, strict=True):
        low, high = getattr(EVERYTHING.randomisation, name)
        values = np.floor(column) if name == "command_delay" else column
        assert values.min() >= low
        assert values.max() <= high
        assert np.mean(values) == pytest.approx((low + high) / 2.0, abs=0.03 * (high - low))
    assert set(np.floor(first[:, QUANTITIES.index("command_delay")])) == {0.0, 1.0, 2.0, 3.0}
    stand = np.zeros((3000, 2), dtype=np.float32)
    for _ in range(19):
        envs.step(stand)
    going_on = envs.outcomes == 0
    assert np.array_equal(drawn[going_on], first[going_on])
    envs.step(stand)  # the step limit: everybody starts anew
    assert (drawn != first).all()


def test_what_is_drawn_is_what_a_robot_has() -> None:
    spans = RandomisationConfig(
        max_linear_speed=(0.1, 0.25), command_delay=(1, 1), range=(0.5, 3.0), field_of_view=(100.0, 240.0)
    )
    task = TaskConfig(arena=COMPLEX, randomisation=spans)
    envs = NavigationVectorEnv(task, 500, seed=0)
    envs.reset()
    drawn = envs._world.robots.drawn
    assert envs.fields_of_view == pytest.approx(drawn[:, QUANTITIES.index("field_of_view")])
    true = scan(envs.arenas[0], envs.poses, task.lidar, fields_of_view=envs.fields_of_view)
    own = drawn[:, QUANTITIES.index("range"), None].astype(np.float32)
    assert np.allclose(envs.ranges, np.where(true < own, true, 3.5), atol=1e-6)
    before = envs.poses.copy()
    for _ in range(2):
        envs.step(np.tile(np.array([[1.0, 0.0]], dtype=np.float32), (500, 1)))
    driven = np.hypot(*(envs.poses - before)[envs.outcomes == 0, :2].T)
    speed = drawn[envs.outcomes == 0, QUANTITIES.index("max_linear_speed")]
    assert driven == pytest.approx(0.2 * speed, abs=1e-5)  # the first of two commands


def test_a_field_of_view_that_is_always_the_same_is_that_of_such_a_scanner() -> None:
    reward = RewardConfig.preset("clearance")
    drawn = TaskConfig(arena=COMPLEX, reward=reward, randomisation=RandomisationConfig(field_of_view=(90.0, 90.0)))
    narrow = TaskConfig(arena=COMPLEX, reward=reward, lidar=LidarConfig(field_of_view=90.0))
    ours, theirs = (NavigationVectorEnv(task, 100, seed=2) for task in (drawn, narrow))
    assert np.array_equal(ours.reset()[0], theirs.reset()[0])
    for action in np.random.default_rng(0).uniform([0.0, -1.0], 1.0, (50, 100, 2)).astype(np.float32):
        for one, other in zip(ours.step(action)[:4], theirs.step(action)[:4], strict=True):
            assert np.array_equal(one, other)


def test_everything_at_once_goes_on_from_a_state_and_does_not_depend_on_who_drives_beside() -> None:
    many, few = (NavigationVectorEnv(EVERYTHING, n, seed=4) for n in (40, 3))
    many.reset()
    few.reset()
    actions = np.random.default_rng(0).uniform([0.0, -1.0], 1.0, (120, 40, 2)).astype(np.float32)
    for action in actions[:60]:
        assert np.array_equal(many.step(action)[0][:3], few.step(action[:3])[0])
    state = many.get_state()
    other = NavigationVectorEnv(EVERYTHING, 40, seed=9)
    other.reset()
    other.set_state(state)
    for action in actions[60:]:
        for ours, theirs in zip(many.step(action)[:4], other.step(action)[:4], strict=True):
            assert np.array_equal(ours, theirs)


def test_what_nobody_asked_for_is_in_no_state() -> None:
    names = NavigationVectorEnv(TaskConfig(), 2, seed=0).get_state().keys()
    assert not names & {"drawn", "ray_cos", "ahead", "drift", "pending", "held_ranges", "scan_ages"}


@pytest.mark.parametrize(
    ("randomisation", "reason"),
    [
        ({"noise": [0.1]}, "two numbers"),
        ({"noise": [0.2, 0.1]}, "lower one first"),
        ({"noise": [0.0, 0.7]}, "less than or equal to 0.5"),
        ({"range": [1.0, 4.0]}, "beyond the LiDAR's range of 3.5 m"),
        ({"command_delay": [0, 6]}, "less than or equal to 5"),
        ({"field_of_view": [340.0, 361.0]}, "less than or equal to 360"),
    ],
)
def test_spans_that_make_no_sense_are_refused(randomisation: dict[str, list[float]], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        TaskConfig.model_validate({"randomisation": randomisation})


@pytest.mark.parametrize("observation", ["paper", "improved"])
def test_a_heading_that_has_drifted_far_is_still_a_direction(observation: ObservationName) -> None:
    # On the spot for 400 s: the belief drifts by 0.5 sqrt(400) = 10 rad, and is anywhere then.
    task = TaskConfig(
        observation=ObservationConfig.preset(observation), odometry=OdometryConfig(heading_noise=0.5), step_limit=10_000
    )
    envs = NavigationVectorEnv(task, 2000, seed=0)
    envs.reset(options={"poses": [0.0, 0.0, 0.0], "targets": [3.0, 0.0]})
    for _ in range(2000):
        observations = envs.step(np.tile(np.array([[0.0, 1.0]], dtype=np.float32), (2000, 1)))[0]
    believed, bearing = observations[:, 14].astype(float), np.pi * observations[:, 15].astype(float)
    turns = believed if observation == "paper" else 0.5 * believed + 0.5
    assert np.histogram(turns, bins=8, range=(0.0, 1.0))[0] == pytest.approx(np.full(8, 250), abs=70)
    # The position has not drifted, so that the target is where its bearing says.
    heading = np.pi * believed * (2.0 if observation == "paper" else 1.0)
    assert np.cos(bearing) == pytest.approx(np.cos(heading), abs=1e-4)
