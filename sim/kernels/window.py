"""The inner loop of the Dynamic Window Approach, see `sim.baselines.dwa`."""

import math

import numpy as np

from sim.kernels.options import kernel

CLEARANCE_CAP = 0.6
"""Metres of room beyond which more room is no better."""

TOUCH = 1e-4
"""Metres of rounding that passing along something is forgiven."""

NEAR_TARGET = 0.1
"""Metres from the target at which an arc ends well."""


@kernel(allocates=True)
def _choose(ranges, limit, rays, bearing, distance, grid, top_linear, period, steps, keep, weights, action):
    """Write the best action (A,) for one robot, as fractions of the limits, from its scan (scan,) and polar target."""
    angles, origins, leftward = rays
    commands, motions, shares, stuck = grid
    goal_x = distance * math.cos(bearing)
    goal_y = distance * math.sin(bearing)
    best = -np.inf
    # Where nothing is admissible, turn towards the side with more room.
    left = np.float32(0.0)
    right = np.float32(0.0)
    for k in range(ranges.shape[0]):
        if leftward[k]:
            left += ranges[k]
        else:
            right += ranges[k]
    action[:] = stuck[0 if left >= right else 1]
    # Beside something that is nearer than it keeps, a robot may pass, but come no nearer.
    for k in range(ranges.shape[0]):
        if ranges[k] < limit:
            ox = origins[k, 0] + ranges[k] * math.cos(angles[k])
            oy = origins[k, 1] + ranges[k] * math.sin(angles[k])
            keep = min(keep, math.sqrt(ox * ox + oy * oy) - TOUCH)
    for c in range(commands.shape[0]):
        x = 0.0
        y = 0.0
        heading = 0.0
        room = CLEARANCE_CAP + keep
        arrived = False
        forwards = motions[c, 0] * period
        aside = motions[c, 1] * period
        turn = motions[c, 2] * period
        for _ in range(steps):
            cos = math.cos(heading + 0.5 * turn)
            sin = math.sin(heading + 0.5 * turn)
            x += forwards * cos - aside * sin
            y += forwards * sin + aside * cos
            heading += turn
            for k in range(ranges.shape[0]):
                if ranges[k] < limit:
                    ox = origins[k, 0] + ranges[k] * math.cos(angles[k]) - x
                    oy = origins[k, 1] + ranges[k] * math.sin(angles[k]) - y
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
            + weights[2] * shares[c]
            + weights[3] * (distance - after) / (top_linear * period * steps)
        )
        if arrived:
            score += 1.0
        if score > best:
            best = score
            action[:] = commands[c]


@kernel(allocates=True)
def choose_all(ranges, limit, rays, polar, grid, top_linear, period, steps, keep, weights, actions):
    """`_choose` for n robots.

    Args:
        ranges: (n, scan) metres.
        limit: of the LiDAR, metres.
        rays: of the scan (scan,) angles against the heading, (scan, 2) where they begin in the body's frame, and (scan,)
            whether they look to the left.
        polar: (n, 2) bearing and distance of the target.
        grid: the commands (C, A) float32 that are tried, their motions (C, 3) as `sim.actions.twists` has them, their shares
            of the top speed (C,), and (2, A) float32 what to do where none is admissible, with more room left and right.
        top_linear: m/s.
        period: of a step, seconds.
        steps: that an arc is looked ahead.
        keep: metres from obstacles.
        weights: (4,) of the objective.
        actions: (n, A) float32, written.
    """
    for i in range(ranges.shape[0]):
        _choose(
            ranges[i], limit, rays, polar[i, 0], polar[i, 1], grid, top_linear, period, steps, keep, weights, actions[i]
        )  # fmt: skip
