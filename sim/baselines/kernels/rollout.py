"""Rolling a robot's motion out and looking how near its body comes to what a scan sees: shared by the planners."""

import math

from sim.baselines.kernels import kernel


@kernel(inline="always")
def body_gap(px, py, half_length, half_width, radius):
    """Signed distance from a body at the origin, facing x, to a point; a rectangle, or a disc where `half_length` is 0."""
    if half_length > 0.0:
        beyond = abs(px) - half_length
        beside = abs(py) - half_width
        ax = max(beyond, 0.0)
        ay = max(beside, 0.0)
        return math.sqrt(ax * ax + ay * ay) + min(max(beyond, beside), 0.0)
    return math.sqrt(px * px + py * py) - radius


@kernel()
def gap_at(x, y, heading, points, count, half_length, half_width, radius, cap):
    """The smallest gap between a body at a pose and the first `count` points (P, 2), at most `cap`, metres."""
    cos = math.cos(heading)
    sin = math.sin(heading)
    gap = cap
    reach = cap + radius
    for k in range(count):
        dx = points[k, 0] - x
        dy = points[k, 1] - y
        if dx * dx + dy * dy < reach * reach:
            gap = min(gap, body_gap(cos * dx + sin * dy, cos * dy - sin * dx, half_length, half_width, radius))
    return gap


@kernel()
def follow(
    points, count, goal_x, goal_y, half_length, half_width, radius, margin, linear, angular, top_linear, top_angular,
    linear_change, angular_change, period, steps, weights, action,
):  # fmt: skip
    """Write the best action (2,), as fractions of the limits, of the dynamic window (Fox, Burgard and Thrun 1997).

    All is in the robot's frame.

    Args:
        points: (P, 2) what the scan hit, metres.
        count: rows of it that count.
        goal_x: where to go, metres.
        goal_y: likewise.
        half_length: of the body, see `body_gap`.
        half_width: of the body.
        radius: of the disc around the body.
        margin: metres that the body keeps.
        linear: velocity now, as a fraction of the limit.
        angular: likewise.
        top_linear: m/s.
        top_angular: rad/s.
        linear_change: most that `linear` changes in one step.
        angular_change: likewise.
        period: seconds of a step.
        steps: to look ahead.
        weights: (4,) of progress, gap, speed and heading.
        action: (2,), written.

    Returns:
        Whether any motion keeps clear; if none does the action turns on the spot.
    """
    best = -1e9
    found = False
    cap = 0.5
    now = gap_at(0.0, 0.0, 0.0, points, count, half_length, half_width, radius, cap)
    keep = min(margin, now - 1e-3)
    ahead = math.sqrt(goal_x * goal_x + goal_y * goal_y)
    bearing = math.atan2(goal_y, goal_x)
    action[0] = 0.0
    action[1] = 1.0 if bearing >= 0.0 else -1.0
    for a in range(9):
        v = a / 8.0
        if abs(v - linear) > linear_change + 1e-6:
            continue
        for b in range(21):
            w = b / 10.0 - 1.0
            if abs(w - angular) > angular_change + 1e-6:
                continue
            x = 0.0
            y = 0.0
            heading = 0.0
            gap = cap
            nearest = ahead
            for _ in range(steps):
                turn = w * top_angular * period
                x += v * top_linear * period * math.cos(heading + 0.5 * turn)
                y += v * top_linear * period * math.sin(heading + 0.5 * turn)
                heading += turn
                gap = min(gap, gap_at(x, y, heading, points, count, half_length, half_width, radius, cap))
                if gap < keep:
                    break
                left = math.sqrt((goal_x - x) ** 2 + (goal_y - y) ** 2)
                nearest = min(nearest, left)
                if left < 0.1:
                    break
            if gap < keep:
                continue
            error = math.atan2(goal_y - y, goal_x - x) - heading
            error = abs(math.atan2(math.sin(error), math.cos(error)))
            score = (
                weights[0] * (ahead - nearest) / (top_linear * period * steps)
                + weights[1] * min(gap, cap) / cap
                + weights[2] * v
                + weights[3] * (1.0 - error / math.pi)
            )
            if score > best:
                best = score
                found = True
                action[0] = v
                action[1] = w
    return found


@kernel(allocates=True)
def follow_all(
    points, counts, goals, half_length, half_width, radius, margin, fractions, top_linear, top_angular,
    linear_change, angular_change, period, steps, weights, actions,
):  # fmt: skip
    """`follow` for n robots: points (n, P, 2), counts (n,), goals (n, 2), fractions (n, 2), actions (n, 2)."""
    for i in range(points.shape[0]):
        follow(
            points[i], counts[i], goals[i, 0], goals[i, 1], half_length, half_width, radius, margin, fractions[i, 0],
            fractions[i, 1], top_linear, top_angular, linear_change, angular_change, period, steps, weights, actions[i],
        )  # fmt: skip
