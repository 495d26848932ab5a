"""The quantities that may differ from robot to robot, as the kernels read them."""

import numpy as np
from numpy.typing import NDArray

from sim.config import TaskConfig
from sim.kernels.records import DELAY, QUANTITIES


def quantity_spans(task: TaskConfig) -> NDArray[np.float64]:
    """Lowest and highest value of each of `QUANTITIES` in a task, (10, 2); equal where nothing is drawn.

    A delay is drawn as a real number and rounded down, so its span ends one higher.
    """
    fixed: dict[str, float] = {
        "range": task.lidar.range,
        "noise": task.lidar.noise,
        "dropout": task.lidar.dropout,
        "rate": task.lidar.rate,
        "distance_noise": task.odometry.distance_noise,
        "heading_noise": task.odometry.heading_noise,
        "command_delay": task.command_delay,
        "max_linear_speed": task.robot.max_linear_speed,
        "max_angular_speed": task.robot.max_angular_speed,
        "field_of_view": task.lidar.field_of_view,
    }
    spans = np.array([getattr(task.randomisation, name) or (fixed[name],) * 2 for name in QUANTITIES], dtype=np.float64)
    if task.randomisation.command_delay:
        spans[DELAY, 1] += 1.0
    return spans


def longest_delay(task: TaskConfig) -> int:
    """Control steps that the most delayed command of a task waits."""
    return max((task.command_delay,) if not task.randomisation.command_delay else task.randomisation.command_delay)
