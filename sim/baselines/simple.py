"""Controllers that need no training: what a policy has to beat."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sim.config import TaskConfig

Floats = NDArray[np.float32]
PolicyFunction = Callable[[Floats], Floats]

_TURN_GAIN = 2.0  # 1/s; quick turns that do not overshoot at a control period of 0.2 s


def random_policy(seed: int = 0) -> PolicyFunction:
    """Actions drawn uniformly from the action space, whatever it sees."""
    rng = np.random.default_rng(seed)
    return lambda observations: rng.uniform([0.0, -1.0], 1.0, (len(observations), 2)).astype(np.float32)


def go_to_goal(task: TaskConfig) -> PolicyFunction:
    """Turn towards the target and drive, slower the more it has to turn; blind to obstacles."""

    def act(observations: Floats) -> Floats:
        angle = bearings(task, observations)
        linear = np.clip(np.cos(angle), 0.0, 1.0)
        angular = np.clip(_TURN_GAIN * angle / task.robot.max_angular_speed, -1.0, 1.0)
        return np.stack([linear, angular], axis=1).astype(np.float32)

    return act


def bearings(task: TaskConfig, observations: Floats) -> Floats:
    """Direction of the target against the heading, (n,) radians in [-pi, pi], read from observations (n, numbers)."""
    first = task.lidar.batches + 3
    if task.observation == "improved":
        return np.asarray(observations[:, first] * np.pi, dtype=np.float32)
    turns = observations[:, first] - observations[:, first + 1]
    return np.asarray((turns - np.round(turns)) * 2.0 * np.pi, dtype=np.float32)
