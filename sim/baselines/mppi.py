"""MPPI (Williams, Aldrich and Theodorou 2017, "Model Predictive Path Integral Control"): the sampling baseline.

It sees what the policy's scanner sees, with every ray, has no map, and remembers the plan of the step before. Its costs are
those that its kin in ROS 2's navigation has, in short: collision, room, way left, and heading.
"""

from collections.abc import Callable

import numpy as np

from sim.arrays import Floats
from sim.baselines.kernels.sampling import sample_all
from sim.baselines.scans import Body, Drive, Scans, goals
from sim.config import TaskConfig
from sim.suites import Situation

SAMPLES = 128
HORIZON = 2.4
"""Seconds that a plan is long."""

MARGIN = 0.25
"""Metres within which room is dear."""

# Standard deviations of what is tried, as fractions of the limits; how many tables of noise take turns.
_SPREAD = (0.35, 0.45)
_TABLES = 32
_TEMPERATURE = 0.3
# Of a step in collision, of room, of the way left, and of heading.
_WEIGHTS = (100.0, 1.0, 3.0, 0.15)


def path_integral(task: TaskConfig) -> Callable[[Situation], Floats]:
    """The planner as a controller for `sim.suites.run_controller`; one for each run, since it remembers."""
    scans, drive, body = Scans(task), Drive.of(task), Body.of(task)
    steps = max(4, round(HORIZON / task.control_period))
    noise = np.random.default_rng(0).normal(0.0, 1.0, (_TABLES, SAMPLES, steps, 2)) * _SPREAD
    # Smooth in time: jerky samples come nowhere.
    noise = np.cumsum(noise, axis=2) / np.sqrt(np.arange(1, steps + 1))[:, None]
    noise[:, 0] = 0.0
    noise[:, 1] = (1.0, 0.0)
    noise[:, 2], noise[:, 3] = (-1.0, 1.0), (-1.0, -1.0)
    plans = np.zeros((0, steps, 2))
    taken = np.zeros(0, dtype=np.int64)

    def act(situation: Situation) -> Floats:
        nonlocal plans, taken
        which = situation.robots
        missing = int(which.max()) + 1 - len(plans)
        if missing > 0:
            plans = np.pad(plans, ((0, missing), (0, 0), (0, 0)))
            taken = np.pad(taken, (0, missing))
        table = noise[int(taken[which[0]]) % _TABLES]
        taken[which] += 1
        points, counts = scans.points(situation)
        now = plans[which]
        actions = np.zeros((len(which), 2), dtype=np.float32)
        sample_all(
            points, counts, goals(situation), body.half_length, body.half_width, body.radius, MARGIN,
            drive.fractions(situation), drive.top_linear, drive.top_angular, drive.linear_change, drive.angular_change,
            task.control_period, table, now, _TEMPERATURE, np.array(_WEIGHTS), actions,
        )  # fmt: skip
        plans[which] = now
        return actions

    return act
