"""ORCA (van den Berg et al. 2011) for a robot among people, on a way that is mapped while driving.

It is told where everybody is and how fast, exactly: more than a scan says. Things it knows from its scan. It takes the whole
avoidance upon itself, since it is not told who gives way. A differential drive moves a point ahead of its middle in any
direction, as Snape et al. 2010 ("Smooth and collision-free navigation for multiple robots under differential-drive
constraints") have it, with a disc around that point that covers the body.
"""

from collections.abc import Callable

import numpy as np

from sim.arrays import Floats
from sim.baselines.memory import Maps
from sim.baselines.scans import Drive
from sim.config import TaskConfig
from sim.kernels.reciprocal import steer_all
from sim.suites import Situation

LEAD = 0.15
"""Metres from the robot's middle to the point that is steered."""

HORIZON = 2.0
"""Seconds for which people are kept apart, as they do among one another."""

INTERVAL = 0.4
"""Seconds for which things are."""

NEAR = 12
"""Points of a scan that count, the nearest ones."""


def reciprocal_avoidance(task: TaskConfig) -> Callable[[Situation], Floats]:
    """The controller for `sim.suites.run_controller`; one for each run, since it remembers its map."""
    maps, drive = Maps(task, moving=False), Drive.of(task)
    radius = task.passable_clearance + LEAD

    def act(situation: Situation) -> Floats:
        carrots = maps.carrots(situation)
        points, counts = maps.scans.points(situation)
        points = points[:, : max(NEAR, 1)]
        poses = situation.poses.astype(np.float64)
        cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
        around = np.stack(
            [cos * points[..., 0] - sin * points[..., 1], sin * points[..., 0] + cos * points[..., 1]], axis=-1
        )
        actions = np.zeros((len(carrots), 2), dtype=np.float32)
        steer_all(
            poses, situation.velocities.astype(np.float64), carrots, around + poses[:, None, :2],
            np.minimum(counts, points.shape[1]), situation.discs.astype(np.float64), radius, LEAD, drive.top_linear,
            drive.top_angular, task.control_period, HORIZON, INTERVAL, actions,
        )  # fmt: skip
        return actions

    return act
