"""What the robots do in a window, in numbers that can be worked by hand."""

import numpy as np
import pytest

from workers.training.behavior import BehaviorMetrics


def window(actions: np.ndarray, observations: np.ndarray | None = None) -> dict[str, float]:
    """The metrics of (steps, robots, 2) actions."""
    steps, robots, _ = actions.shape
    seen = np.zeros((steps, robots, 16)) if observations is None else observations
    metrics = BehaviorMetrics()
    for step in range(steps):
        metrics.step(seen[step].astype(np.float32), actions[step].astype(np.float32))
    return metrics.flush()


def test_robots_that_circle_one_way_each_spin() -> None:
    actions = np.zeros((8, 2, 2))
    actions[:, :, 0] = 0.25
    actions[:, 0, 1], actions[:, 1, 1] = 0.5, -1.0
    metrics = window(actions)
    assert metrics["train/linear_speed"] == pytest.approx(0.25)
    assert metrics["train/angular_speed"] == pytest.approx(0.75)
    assert metrics["train/spin"] == pytest.approx(0.75)
    assert metrics["policy/saturation"] == pytest.approx(0.5)


def test_robots_that_weave_do_not_spin() -> None:
    actions = np.ones((8, 3, 2))
    actions[4:, :, 1] = -1.0  # of the sampled steps 4 and 8 one turns left, one right
    metrics = window(actions)
    assert metrics["train/angular_speed"] == pytest.approx(1.0)
    assert metrics["train/spin"] == pytest.approx(0.0)


def test_commands_count_as_the_robot_executes_them() -> None:
    metrics = window(np.full((4, 1, 2), (-3.0, 7.0)))
    assert metrics["train/linear_speed"] == 0.0
    assert metrics["train/angular_speed"] == 1.0


def test_numbers_that_do_not_vary_are_constant() -> None:
    observations = np.random.default_rng(0).uniform(size=(16, 32, 16))
    observations[:, :, 3] = 0.4
    observations[:, :, 7] = -1.0
    observations[3, 5, 7] = 1.0  # once in 512
    metrics = window(np.zeros((16, 32, 2)), observations)
    assert metrics["observation/constant"] == pytest.approx(2 / 16)


def test_a_few_observations_say_nothing_about_constancy() -> None:
    assert "observation/constant" not in window(np.zeros((4, 63, 2)))
    assert BehaviorMetrics().flush() == {}
