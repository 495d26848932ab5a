"""The inner loop of the Dynamic Window Approach, see `sim.baselines.dwa`."""

import math

import numpy as np

from sim.kernels.options import kernel

LINEAR_SAMPLES = 6
ANGULAR_SAMPLES = 15

CLEARANCE_CAP = 0.6
"""Metres of room beyond which more room is no better."""

TOUCH = 1e-4
"""Metres of rounding that passing along something is forgiven."""

NEAR_TARGET = 0.1
"""Metres from the target at which an arc ends well."""


@kernel(allocates=True)
def _choose(ranges, limit, angles, bearing, distance, top_linear, top_angular, period, steps, keep, weights, action):
    """Write the best action (2,) for one robot, as fractions of the limits, from its scan (rays,) and polar target."""
    goal_x = distance * math.cos(bearing)
    goal_y = distance * math.sin(bearing)
    best = -np.inf
    # Where nothing is admissible, turn on the spot towards the side with more room.
    half = ranges.shape[0] // 2
    action[0] = 0.0
    action[1] = 1.0 if ranges[half:].sum() >= ranges[:half].sum() else -1.0
    # Beside something that is nearer than it keeps, a robot may pass, but come no nearer.
    keep = min(keep, ranges.min() - TOUCH)
    for a in range(1, LINEAR_SAMPLES):
        linear = a / (LINEAR_SAMPLES - 1)
        for b in range(ANGULAR_SAMPLES):
            angular = 2.0 * b / (ANGULAR_SAMPLES - 1) - 1.0
            x = 0.0
            y = 0.0
            heading = 0.0
            room = CLEARANCE_CAP + keep
            arrived = False
            for _ in range(steps):
                turn = angular * top_angular * period
                x += linear * top_linear * period * math.cos(heading + 0.5 * turn)
                y += linear * top_linear * period * math.sin(heading + 0.5 * turn)
                heading += turn
                for k in range(ranges.shape[0]):
                    if ranges[k] < limit:
                        ox = ranges[k] * math.cos(angles[k]) - x
                        oy = ranges[k] * math.sin(angles[k]) - y
                        room = min(room, math.sqrt(ox * ox + oy * oy))
                if (goal_x - x) ** 2 + (goal_y - y) ** 2 < NEAR_TARGET * NEAR_TARGET:
                    arrived = True
                    break
                if room < keep:
                    break
            if room < keep:
                continue
            after = math.sqrt((goal_x - x) ** 2 + (goal_y - y) ** 2)
            error = math.atan2(goal_y - y, goal_x - x) - heading
            error = abs(math.atan2(math.sin(error), math.cos(error)))
            score = (
                weights[0] * (1.0 - error / math.pi)
                + weights[1] * (room - keep) / CLEARANCE_CAP
                + weights[2] * linear
                + weights[3] * (distance - after) / (top_linear * period * steps)
            )
            if arrived:
                score += 1.0
            if score > best:
                best = score
                action[0] = linear
                action[1] = angular


@kernel(allocates=True)
def choose_all(ranges, limit, angles, polar, top_linear, top_angular, period, steps, keep, weights, actions):
    """`_choose` for n robots: ranges (n, rays), polar (n, 2) bearing and distance, actions (n, 2)."""
    for i in range(ranges.shape[0]):
        _choose(
            ranges[i], limit, angles, polar[i, 0], polar[i, 1], top_linear, top_angular, period, steps, keep, weights,
            actions[i],
        )  # fmt: skip
