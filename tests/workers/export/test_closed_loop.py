"""A policy, from training to the code that ships, drives to its targets with a sensor that it has never seen."""

import io
import math
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sim.arenas import build_arenas
from sim.config import LidarConfig
from sim.envs.vector import NavigationVectorEnv
from sim.scan import scan as scan_arena
from workers.config import EvaluationConfig, TrainingConfig
from workers.export.bundle import bundle, export_checkpoint
from workers.export.ros2.mapless_navigator.navigator import Navigator, Safety, State
from workers.export.ros2.mapless_navigator.observation import Scan
from workers.export.ros2.mapless_navigator.policy import Policy
from workers.frames import Frame
from workers.reporting import EvaluationResult, EventLevel, WatchRequest
from workers.training.trainer import train

# A full circle of one beam a degree, first beam ahead, then to the left: the LDS-01 of a TurtleBot3.
SENSOR = LidarConfig(rays=360, field_of_view=360.0)
SENSOR_YAW = math.pi  # its first ray here points backwards


class LastCheckpoint:
    """A reporter that keeps the newest archive."""

    watch: WatchRequest | None = None
    stop_requested = False
    archive: Path

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        pass

    def event(self, step: int, level: EventLevel, message: str) -> None:
        pass

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        self.archive = archive

    def frames(self, frames: Sequence[Frame]) -> None:
        pass


def sensed(ranges: np.ndarray, rng: np.random.Generator) -> Scan:
    """What the sensor writes: noise of 5 mm, infinity without a hit, one beam in fifty lost."""
    written = np.where(ranges >= 3.5, np.inf, ranges + rng.normal(scale=0.005, size=ranges.shape))
    written[rng.random(len(ranges)) < 0.02] = 0.0
    return Scan(0.0, 2.0 * math.pi / len(ranges), 0.12, 3.5, written)


def test_a_trained_policy_arrives_through_the_code_that_ships(tmp_path: Path) -> None:
    reporter = LastCheckpoint()
    training = TrainingConfig(steps=100_000, evaluation=EvaluationConfig(every_steps=100_000))
    train(training, 0, reporter, tmp_path / "checkpoints")
    with zipfile.ZipFile(io.BytesIO(bundle(export_checkpoint(reporter.archive)))) as archive:
        archive.extractall(tmp_path)
    policy = Policy.load(tmp_path / "mapless-policy" / "policy")
    safety = replace(Safety.of(policy.specification), sensor_yaw=SENSOR_YAW)

    robots = 8
    env = NavigationVectorEnv(training.task, robots, seed=1)
    env.reset(seed=1)
    arena, rng = build_arenas(training.task.arena)[0], np.random.default_rng(1)
    limits = np.array([policy.specification.max_linear_speed, policy.specification.max_angular_speed])
    navigators = [Navigator(policy, safety) for _ in range(robots)]
    for navigator, target in zip(navigators, env.targets, strict=True):
        x, y = map(float, target)
        navigator.set_goal(x, y)

    arrived = np.zeros(robots, np.bool_)
    for step in range(300):
        now = training.task.control_period * step
        scans = scan_arena(arena, env.poses, SENSOR)
        commands = np.zeros((robots, 2), np.float32)
        for robot, navigator in enumerate(navigators):
            navigator.set_scan(now, sensed(scans[robot], rng))
            x, y, heading = map(float, env.poses[robot])
            navigator.set_odometry(now, x, y, heading)
            command = navigator.command(now)
            commands[robot] = np.array([command.linear, command.angular]) / limits
            arrived[robot] |= command.state is State.ARRIVED
        _, _, terminations, _, _ = env.step(commands)
        assert not terminations[~arrived].any(), "a robot has collided"
        # In the simulator an arrival brings a new target, which is not this navigator's.
        arrived |= env.outcomes == 1
        if arrived.all():
            break
    assert arrived.all()
