"""The Dynamic Window Approach (Fox, Burgard and Thrun 1997): the classical local planner that policies are compared with.

From its full scan (a policy sees the minima of batches only) it predicts the arcs of a grid of velocities and drives the
best of those that keep clear. It knows no map and has no memory, so it can get stuck where the way leads away from
the target.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sim.config import TaskConfig
from sim.kernels.window import choose_all
from sim.lidar import ray_angles
from sim.suites import Situation

Floats = NDArray[np.float32]

HORIZON = 2.4
"""Seconds that an arc is looked ahead."""

MARGIN = 0.04
"""Metres that an arc keeps from obstacles on top of the collision distance."""

# Weights of the objective, the best of eight tried on random clutter that is in no suite (docs/suites.md).
HEADING, CLEARANCE, SPEED, PROGRESS = 0.1, 0.3, 0.1, 1.0


def dynamic_window(
    task: TaskConfig, weights: tuple[float, float, float, float] = (HEADING, CLEARANCE, SPEED, PROGRESS)
) -> Callable[[Situation], Floats]:
    """The planner as a controller for `sim.suites.run_controller`.

    Args:
        task: its robot, LiDAR and limits.
        weights: of heading, clearance, speed and progress in the objective.
    """
    angles = ray_angles(task.lidar)
    keep = task.passable_clearance + MARGIN
    steps = max(1, round(HORIZON / task.control_period))

    def act(situation: Situation) -> Floats:
        dx, dy = (situation.targets - situation.poses[:, :2]).astype(np.float64).T
        bearing = np.arctan2(dy, dx) - situation.poses[:, 2]
        actions = np.zeros((len(situation.poses), 2), dtype=np.float32)
        choose_all(
            situation.ranges,
            task.lidar.range,
            angles,
            np.stack([bearing, np.hypot(dx, dy)], axis=1),
            task.robot.max_linear_speed,
            task.robot.max_angular_speed,
            task.control_period,
            steps,
            keep,
            np.array(weights),
            actions,
        )
        return actions

    return act
