"""The inner loop of MPPI, see `sim.baselines.mppi`."""

import math

import numpy as np

from sim.baselines.kernels import kernel
from sim.baselines.kernels.rollout import gap_at

CAP = 0.4
"""Metres of room beyond which more room is no better."""


@kernel(allocates=True)
def sample_all(
    points, counts, goals, half_length, half_width, radius, margin, fractions, top_linear, top_angular, linear_change,
    angular_change, period, noise, plans, temperature, weights, actions,
):  # fmt: skip
    """Improve the plans of n robots by one round of samples, and write their first actions (n, 2).

    Args:
        points: (n, P, 2) what each scan hit, in the robot's frame, metres.
        counts: (n,) rows of them that count.
        goals: (n, 2) in the robot's frame, metres.
        half_length: of the body, see `sim.baselines.kernels.rollout.body_gap`.
        half_width: of the body.
        radius: of the disc around the body.
        margin: metres within which room is dear.
        fractions: (n, 2) velocities now, as fractions of the limits.
        top_linear: m/s.
        top_angular: rad/s.
        linear_change: most that the fraction of the speed changes in one step.
        angular_change: likewise, of the turning rate.
        period: seconds of a step.
        noise: (K, T, 2) what is added to a plan.
        plans: (n, T, 2) fractions of the limits step by step; improved.
        temperature: of the weighting.
        weights: (4,) of collision, room, way left and speed.
        actions: (n, 2), written.
    """
    samples, horizon = noise.shape[:2]
    tried = np.empty((samples, horizon, 2))
    costs = np.empty(samples)
    for i in range(points.shape[0]):
        goal_x = goals[i, 0]
        goal_y = goals[i, 1]
        for k in range(samples):
            x = 0.0
            y = 0.0
            heading = 0.0
            v = fractions[i, 0]
            w = fractions[i, 1]
            cost = 0.0
            left = math.sqrt(goal_x * goal_x + goal_y * goal_y)
            arrived = False
            for t in range(horizon):
                u = min(max(plans[i, t, 0] + noise[k, t, 0], 0.0), 1.0)
                z = min(max(plans[i, t, 1] + noise[k, t, 1], -1.0), 1.0)
                v = min(max(u, v - linear_change), v + linear_change)
                w = min(max(z, w - angular_change), w + angular_change)
                tried[k, t, 0] = v
                tried[k, t, 1] = w
                if arrived:
                    continue
                turn = w * top_angular * period
                x += v * top_linear * period * math.cos(heading + 0.5 * turn)
                y += v * top_linear * period * math.sin(heading + 0.5 * turn)
                heading += turn
                gap = gap_at(x, y, heading, points[i], counts[i], half_length, half_width, radius, CAP)
                if gap < 0.01:
                    cost += weights[0]
                cost += weights[1] * max(0.0, margin - gap) / margin
                left = math.sqrt((goal_x - x) ** 2 + (goal_y - y) ** 2)
                error = math.atan2(goal_y - y, goal_x - x) - heading
                cost += weights[3] * (1.0 - v * math.cos(error)) + weights[2] * left / (top_linear * period * horizon)
                arrived = left < 0.1
            costs[k] = cost + horizon * weights[2] * left / (top_linear * period * horizon)
        lowest = costs.min()
        total = 0.0
        plans[i, :, :] = 0.0
        for k in range(samples):
            weight = math.exp(-(costs[k] - lowest) / temperature)
            total += weight
            for t in range(horizon):
                plans[i, t, 0] += weight * tried[k, t, 0]
                plans[i, t, 1] += weight * tried[k, t, 1]
        for t in range(horizon):
            plans[i, t, 0] /= total
            plans[i, t, 1] /= total
        actions[i, 0] = plans[i, 0, 0]
        actions[i, 1] = plans[i, 0, 1]
        for t in range(horizon - 1):
            plans[i, t, 0] = plans[i, t + 1, 0]
            plans[i, t, 1] = plans[i, t + 1, 1]
