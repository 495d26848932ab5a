"""Before the physics: from actions to the velocities of the bodies."""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.records import DELAY, MAX_ANGULAR, MAX_LINEAR

ZERO = np.float32(0.0)
ONE = np.float32(1.0)

_SERIES = 1e-4
"""Below this half angle sin(h)/h is 1 - h²/6 to the last bit."""


@kernel()
def _largest_change(acceleration, limit, period):
    """Change of a velocity in one period as a fraction of its limit; 2, the whole span, where it is unlimited."""
    return np.float32(min(2.0, acceleration * period / limit) if acceleration > 0.0 else 2.0)


@kernel()
def _delayed(i, linear, angular, delay, pending):
    """The action that robot i follows now, which it was given `delay` steps ago; the new one joins the queue."""
    now_linear = pending[i, 0, 0]
    now_angular = pending[i, 0, 1]
    for k in range(delay - 1):
        pending[i, k, 0] = pending[i, k + 1, 0]
        pending[i, k, 1] = pending[i, k + 1, 1]
    pending[i, delay - 1, 0] = linear
    pending[i, delay - 1, 1] = angular
    return now_linear, now_angular


@kernel()
def write_commands(actions, robots, state, command, parameters):
    """Turn actions into the bodies' velocities, as late as robots follow them.

    The velocity points along the chord of the arc that the robot drives in one period, so that one explicit step of the
    physics ends exactly on the arc (plain Euler is 48 mm off after 10 s).

    Args:
        actions: (N, 2) linear in [0, 1] and angular in [-1, 1], as fractions of the limits; clipped.
        robots: `sim.kernels.bundles.Robots`, whose velocities and pending actions are updated.
        state: (bodies, 3) x, y, angle in the Space.
        command: (bodies, 3) vx, vy, angular velocity; the first N rows are written.
        parameters: (1,) PARAMETERS.

    Returns:
        -1, or the first robot whose action is not finite; nothing is written for it and those after it.
    """
    p = parameters[0]
    records = robots.records
    for i in range(actions.shape[0]):
        if records[i].parked:
            command[i, :] = 0.0
            continue
        linear = actions[i, 0]
        angular = actions[i, 1]
        if not (math.isfinite(linear) and math.isfinite(angular)):
            return i
        linear = min(max(linear, ZERO), ONE)
        angular = min(max(angular, -ONE), ONE)
        delay = int(robots.drawn[i, DELAY])
        if delay > 0:
            linear, angular = _delayed(i, linear, angular, delay, robots.pending)
        max_linear = robots.drawn[i, MAX_LINEAR]
        max_angular = robots.drawn[i, MAX_ANGULAR]
        change = _largest_change(p.max_linear_acceleration, max_linear, p.period)
        linear = min(max(linear, records[i].linear - change), records[i].linear + change)
        change = _largest_change(p.max_angular_acceleration, max_angular, p.period)
        angular = min(max(angular, records[i].angular - change), records[i].angular + change)
        records[i].last_linear = records[i].linear
        records[i].last_angular = records[i].angular
        records[i].linear = linear
        records[i].angular = angular
        turn = max_angular * angular
        half = 0.5 * turn * p.period
        chord = math.sin(half) / half if abs(half) > _SERIES else 1.0 - half * half / 6.0
        speed = max_linear * linear * chord
        direction = state[i, 2] + half
        command[i, 0] = speed * math.cos(direction)
        command[i, 1] = speed * math.sin(direction)
        command[i, 2] = turn
    return -1
