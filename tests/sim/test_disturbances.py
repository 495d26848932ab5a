"""What makes a robot's life harder: noise and dropouts of the LiDAR, limits of acceleration."""

import numpy as np
import pytest

from sim.config import ArenaConfig, LidarConfig, RobotConfig, TaskConfig
from sim.scan import scan
from sim.vector_env import NavigationVectorEnv

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
    robot = RobotConfig(max_linear_acceleration=0.25, max_angular_acceleration=2.0)
    envs = NavigationVectorEnv(TaskConfig(robot=robot), 1, seed=0)
    envs.reset(options={"poses": [0.0, 0.0, 0.0], "targets": [3.0, 0.0]})
    seen = []
    for action in ([1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [0.0, -1.0]):
        observation, *_ = envs.step(np.array([action], dtype=np.float32))
        seen.append(observation[0, 10:12].tolist())
    assert np.array(seen) == pytest.approx(np.array([[0.2, 0.4], [0.4, 0.8], [0.6, 0.4], [0.4, 0.0]]), abs=1e-6)
    # The way driven is that of the velocities reached, not of those asked for.
    assert envs.attempt_path_lengths[0] == pytest.approx(0.05 * (0.2 + 0.4 + 0.6 + 0.4), rel=1e-6)
