"""Before the physics: from actions to the velocities of the bodies."""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.records import ACKERMANN, DELAY, DIFFERENTIAL, MAX_ANGULAR, MAX_LINEAR, OMNIDIRECTIONAL

ZERO = np.float32(0.0)
ONE = np.float32(1.0)

_SERIES = 1e-4
"""Below this half angle sin(h)/h is 1 - h²/6 to the last bit."""


@kernel()
def _largest_change(acceleration, limit, period):
    """Change of a velocity in one period as a fraction of its limit; 2, the whole span, where it is unlimited."""
    return np.float32(min(2.0, acceleration * period / limit) if acceleration > 0.0 else 2.0)


@kernel()
def _delayed(i, linear, lateral, angular, delay, pending):
    """The action that robot i follows now, which it was given `delay` steps ago; the new one joins the queue."""
    last = pending.shape[2] - 1
    now_linear = pending[i, 0, 0]
    now_lateral = pending[i, 0, 1] if last == 2 else ZERO
    now_angular = pending[i, 0, last]
    for k in range(delay - 1):
        for part in range(last + 1):
            pending[i, k, part] = pending[i, k + 1, part]
    pending[i, delay - 1, 0] = linear
    if last == 2:
        pending[i, delay - 1, 1] = lateral
    pending[i, delay - 1, last] = angular
    return now_linear, now_lateral, now_angular


@kernel()
def _steered(forwards, steering, max_angular, p):
    """Turning rate of an Ackermann drive, rad/s."""
    turn = forwards * math.tan(p.steering_limit * steering) / p.wheel_base
    return min(max(turn, -max_angular), max_angular)


@kernel(inline="always")
def twist(linear, lateral, angular, max_linear, max_angular, p):
    """Speeds forwards and to the left, m/s, and turning rate, rad/s, of fractions that are followed; see `sim.actions`."""
    forwards = max_linear * linear
    if p.drive == ACKERMANN:
        turn = _steered(forwards, angular, max_angular, p)
        return forwards, 0.5 * p.wheel_base * turn, turn
    if p.drive == OMNIDIRECTIONAL:
        return forwards, max_linear * p.sideways * lateral, max_angular * angular
    return forwards, 0.0, max_angular * angular


@kernel(inline="always")
def _follow(command, last, change):
    """What is followed of a command: no more than `change` from what was."""
    return min(max(command, last - change), last + change)


@kernel()
def write_commands(actions, robots, state, command, parameters):
    """Turn actions into the bodies' velocities, as late as robots follow them.

    The velocity points along the chord of the arc that the robot drives in one period, so that one explicit step of the
    physics ends exactly on the arc (plain Euler is 48 mm off after 10 s).

    Args:
        actions: (N, A) fractions of the limits, see `sim.actions`; clipped.
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
        lateral = actions[i, 1] if p.drive == OMNIDIRECTIONAL else ZERO
        angular = actions[i, actions.shape[1] - 1]
        if not (math.isfinite(linear) and math.isfinite(lateral) and math.isfinite(angular)):
            return i
        linear = min(max(linear, p.least_linear), ONE)
        lateral = min(max(lateral, -ONE), ONE)
        angular = min(max(angular, -ONE), ONE)
        if robots.commands.shape[0]:
            robots.commands[i, 0] = linear
            if p.drive == OMNIDIRECTIONAL:
                robots.commands[i, 1] = lateral
            robots.commands[i, robots.commands.shape[1] - 1] = angular
        delay = int(robots.drawn[i, DELAY])
        if delay > 0:
            linear, lateral, angular = _delayed(i, linear, lateral, angular, delay, robots.pending)
        max_linear = robots.drawn[i, MAX_LINEAR]
        max_angular = robots.drawn[i, MAX_ANGULAR]
        linear = _follow(linear, records[i].linear, _largest_change(p.max_linear_acceleration, max_linear, p.period))
        if p.drive == OMNIDIRECTIONAL:
            change = _largest_change(p.max_linear_acceleration, p.sideways * max_linear, p.period)
            lateral = _follow(lateral, records[i].lateral, change)
            records[i].last_lateral = records[i].lateral
            records[i].lateral = lateral
        if p.drive == ACKERMANN:
            change = _largest_change(p.steering_rate, p.steering_limit, p.period)
        else:
            change = _largest_change(p.max_angular_acceleration, max_angular, p.period)
        angular = _follow(angular, records[i].angular, change)
        records[i].last_linear = records[i].linear
        records[i].last_angular = records[i].angular
        records[i].linear = linear
        records[i].angular = angular
        forwards, aside, turn = twist(linear, lateral, angular, max_linear, max_angular, p)
        half = 0.5 * turn * p.period
        chord = math.sin(half) / half if abs(half) > _SERIES else 1.0 - half * half / 6.0
        direction = state[i, 2] + half
        cos = math.cos(direction)
        sin = math.sin(direction)
        speed = forwards * chord
        command[i, 0] = speed * cos
        command[i, 1] = speed * sin
        if p.drive != DIFFERENTIAL:
            command[i, 0] -= aside * chord * sin
            command[i, 1] += aside * chord * cos
        command[i, 2] = turn
    return -1
