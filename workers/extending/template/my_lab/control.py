"""How the baseline drives."""

import numpy as np

from my_lab import TimidBaseline
from sim.extending.control import Controller, Floats, Situation, TaskConfig


def timid(baseline: TimidBaseline, task: TaskConfig) -> Controller:
    """The controller of a task: what the robots under way see, to their actions (n, 2)."""

    def act(situation: Situation) -> Floats:
        dx, dy = (situation.targets - situation.poses[:, :2]).T
        bearing = np.arctan2(dy, dx) - situation.poses[:, 2]
        bearing = np.arctan2(np.sin(bearing), np.cos(bearing))
        room = situation.ranges.min(axis=1) - task.collision_distance
        linear = np.clip(np.cos(bearing), 0.0, 1.0) * np.clip(room / baseline.caution, 0.1, 1.0)
        angular = np.clip(2.0 * bearing / task.robot.max_angular_speed, -1.0, 1.0)
        return np.stack([linear, angular], axis=1).astype(np.float32)

    return act
