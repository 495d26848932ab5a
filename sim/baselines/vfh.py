"""VFH+ (Ulrich and Borenstein 1998): the reactive baseline.

It sees what the policy's scanner sees, with every ray; it has no map and remembers nothing but the histogram and the
direction of the step before. A robot that turns on the spot has no circles to mask.
"""

from collections.abc import Callable

import numpy as np

from sim.arrays import Floats
from sim.baselines.kernels.histogram import SECTORS, steer_all
from sim.baselines.scans import Drive, Scans, goals
from sim.config import TaskConfig
from sim.suites import Situation

KEEP = 0.05
"""Metres beside the body that count as blocked."""

SIGHT = 1.5
"""Seconds at top speed from which on an obstacle blocks a direction; at least `LEAST` metres."""

LEAST = 0.8
HYSTERESIS = 1.2
"""A blocked direction becomes free again when its obstacles are so many times as far."""


def vector_field_histogram(task: TaskConfig) -> Callable[[Situation], Floats]:
    """The planner as a controller for `sim.suites.run_controller`; one for each run, since it remembers."""
    scans, drive, radius = Scans(task), Drive.of(task), task.passable_clearance
    near = min(max(LEAST, SIGHT * drive.top_linear) + radius, 0.8 * scans.limit)
    blocked = np.zeros((0, SECTORS), dtype=np.bool_)
    previous = np.zeros(0)
    spacing = float(scans.angles[1] - scans.angles[0])

    def act(situation: Situation) -> Floats:
        nonlocal blocked, previous
        which = situation.robots
        missing = int(which.max()) + 1 - len(previous)
        if missing > 0:
            blocked = np.pad(blocked, ((0, missing), (0, 0)))
            previous = np.pad(previous, (0, missing))
        gx, gy = goals(situation).T
        ranges, angles = scans.polar(situation)
        actions = np.zeros((len(which), 2), dtype=np.float32)
        now, chosen = blocked[which], previous[which]
        steer_all(
            ranges, scans.limit, angles, spacing, np.arctan2(gy, gx), np.hypot(gx, gy), radius, KEEP, near,
            HYSTERESIS * near, drive.top_linear, drive.top_angular, task.control_period, now, chosen, actions,
        )  # fmt: skip
        blocked[which], previous[which] = now, chosen
        return actions

    return act
