"""The inner loop of ORCA for a robot that cannot go sideways, see `sim.baselines.orca`."""

import math

import numpy as np

from sim.kernels.avoidance import choose_velocity, orca_line
from sim.kernels.options import kernel

ZERO = 0.0


@kernel(allocates=True)
def steer_all(
    poses,
    velocities,
    goals,
    points,
    counts,
    discs,
    radius,
    lead,
    top_linear,
    top_angular,
    period,
    horizon,
    interval,
    actions,
):
    """Write the actions (n, 2), as fractions of the limits, of robots among people and things.

    Args:
        poses: (n, 3) x, y, heading.
        velocities: (n, 2) m/s, rad/s.
        goals: (n, 2) where each wants to go, metres.
        points: (n, P, 2) surfaces around each, metres.
        counts: (n,) rows of them that count.
        discs: (n, K, 5), see `sim.kernels.records.DISC_COLUMNS`.
        radius: of a disc round the point `lead` metres ahead of a robot's middle that covers its body, metres.
        lead: metres; that point can be moved in any direction.
        top_linear: m/s.
        top_angular: rad/s.
        period: of the discs' last step, seconds.
        horizon: seconds for which people are kept apart.
        interval: seconds for which things are.
        actions: (n, 2), written.
    """
    lines = np.empty((points.shape[1] + discs.shape[1], 3))
    scratch = np.empty_like(lines)
    velocity = np.empty(2)
    for i in range(poses.shape[0]):
        cos = math.cos(poses[i, 2])
        sin = math.sin(poses[i, 2])
        cx = poses[i, 0] + lead * cos
        cy = poses[i, 1] + lead * sin
        vx = velocities[i, 0] * cos - velocities[i, 1] * lead * sin
        vy = velocities[i, 0] * sin + velocities[i, 1] * lead * cos
        n = 0
        for k in range(counts[i]):
            px = points[i, k, 0] - cx
            py = points[i, k, 1] - cy
            distance = max(math.sqrt(px * px + py * py), 1e-6)
            if distance < radius + 2.0 * top_linear * interval:
                lines[n, 0] = px / distance
                lines[n, 1] = py / distance
                lines[n, 2] = max(distance - radius, ZERO) / interval
                n += 1
        hard = n
        for k in range(discs.shape[1]):
            if discs[i, k, 2] <= ZERO:
                continue
            px = discs[i, k, 0] - cx
            py = discs[i, k, 1] - cy
            apart = radius + discs[i, k, 2]
            wx = vx - discs[i, k, 3] / period
            wy = vy - discs[i, k, 4] / period
            if px * px + py * py > apart * apart:
                orca_line(px, py, wx, wy, apart, horizon, 1.0, vx, vy, lines, n)
            else:  # away from it
                distance = max(math.sqrt(px * px + py * py), 1e-6)
                lines[n, 0] = px / distance
                lines[n, 1] = py / distance
                lines[n, 2] = (distance - apart) / interval
            n += 1
        gx = goals[i, 0] - cx
        gy = goals[i, 1] - cy
        pace = top_linear / max(math.sqrt(gx * gx + gy * gy), 1e-6)
        choose_velocity(lines, hard, n, top_linear, pace * gx, pace * gy, scratch, velocity)
        forward = velocity[0] * cos + velocity[1] * sin
        turn = (velocity[1] * cos - velocity[0] * sin) / lead
        if forward < ZERO:  # it does not reverse: turn on the spot
            turn = math.copysign(top_angular, turn)
        # A turn that is too quick is made slower, and the way with it.
        slower = min(1.0, top_angular / max(abs(turn), 1e-9))
        actions[i, 0] = min(max(slower * forward / top_linear, 0.0), 1.0)
        actions[i, 1] = min(max(turn / top_angular, -1.0), 1.0)
