"""What a step is worth: the terms of `sim.config.RewardConfig`, and formulas over a table of quantities."""

import math

import numpy as np

from sim.kernels.commands import twist
from sim.kernels.disturbances import AHEAD
from sim.kernels.observing import bearing_of
from sim.kernels.options import kernel
from sim.kernels.records import (
    ACKERMANN,
    ALIGNMENT_TERM,
    ARRIVAL,
    ARRIVAL_TERM,
    CLEARANCE_TERM,
    COLLISION,
    COLLISION_TERM,
    MAX_ANGULAR,
    MAX_LINEAR,
    OMNIDIRECTIONAL,
    PEOPLE_TERM,
    PROGRESS_TERM,
    PROXIMITY_TERM,
    SMOOTHNESS_TERM,
    SPEED_TERM,
    TIME_TERM,
    TIMEOUT,
    TIMEOUT_TERM,
)
from sim.kernels.sensing import FAST, disc_clearance, nearest_of

ZERO = np.float32(0.0)
ONE = np.float32(1.0)
PI = np.float32(math.pi)
COS_AHEAD = np.float32(math.cos(AHEAD))

MAX_RATIO = np.float32(8.0)
"""Cap of d_{t-1}/d_t in the advanced reward, which would overflow when a robot stands on its target."""

NO_MOVER = np.float32(100.0)
"""Distance of the nearest mover where there is none, metres."""

# Codes of `sim.extending.expression.OPERATIONS`, which `sim.engine.rewards` checks when it is imported.
NUMBER, QUANTITY, CONSTANT, NEGATIVE, IF = range(5)
ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER = range(5, 10)
LESS, LESS_EQUAL, GREATER, GREATER_EQUAL = range(10, 14)
ABS, SQRT, EXP, LOG, SIN, COS, TANH, MIN, MAX, CLIP = range(14, 24)


@kernel()
def _ratio(a, b):
    """A / b, rounded once: without the freedoms below it is not drawn into a product."""
    return a / b


@kernel()
def ahead_of_mounts(i, robots, geometry, p):
    """Metres that rays near the heading see at least, of LiDARs mounted anywhere: by where each ray points."""
    own = i if robots.ahead.shape[0] > 1 else 0
    room = geometry.scan.shape[0]
    rays = geometry.ray_angles.shape[0]
    straightest = np.float32(-1.0)
    for s in range(p.lidars):
        for k in range(rays):
            straightest = max(straightest, robots.ray_cos[own, s * room + k])
    within = min(COS_AHEAD, straightest) - np.float32(1e-6)
    nearest = np.float32(math.inf)
    for s in range(p.lidars):
        for k in range(rays):
            if robots.ray_cos[own, s * room + k] >= within:
                nearest = min(nearest, robots.ranges[i, s * rays + k])
    return nearest


@kernel(fastmath=FAST, inline="always")
def _ahead(i, straight, robots):
    """Metres that robot i's rays near its heading see at least; `straight` where that is known already, below zero not."""
    if straight >= ZERO:
        return straight
    own = i if robots.ahead.shape[0] > 1 else 0
    return nearest_of(robots.ranges, i, robots.ahead[own, 0], robots.ahead[own, 1])


@kernel(fastmath=FAST, inline="always")
def _bearing(i, robots):
    """Radians of robot i's target against its heading."""
    dx = robots.targets[i, 0] - robots.poses[i, 0]
    dy = robots.targets[i, 1] - robots.poses[i, 1]
    return bearing_of(dx, dy, robots.poses[i, 2])


@kernel(fastmath=FAST, inline="always")
def _from_movers(i, tile, robots, geometry, p):
    """Metres from robot i's body, as a disc, to the nearest mover."""
    if geometry.discs.shape[1] == 0:
        return NO_MOVER
    return min(disc_clearance(robots.poses[i, 0], robots.poses[i, 1], tile, geometry.discs) - p.radius, NO_MOVER)


@kernel(fastmath=FAST)
def _way_term(i, k, before, clearance, straight, tile, robots, geometry, p):
    """Term k of a step that ends in neither arrival nor collision."""
    kind = p.term_kinds[k]
    weight = p.term_weights[k]
    record = robots.records[i]
    if kind == PROGRESS_TERM:
        gained = weight * (before - record.distance)
        if p.term_options[k] == ZERO:
            return gained
        ratio = MAX_RATIO if record.distance * MAX_RATIO <= before else before / record.distance
        return gained * np.float32(2.0**ratio)
    if kind == CLEARANCE_TERM:
        return weight - weight * _ratio(_ahead(i, straight, robots), p.range)
    if kind == ALIGNMENT_TERM:
        safety = ONE - abs(_bearing(i, robots)) / PI
        return weight - weight * safety
    if kind == TIME_TERM:
        return weight * np.float32(p.period)
    if kind == PROXIMITY_TERM:
        return weight * max(ZERO, ONE - max(clearance, ZERO) / p.term_options[k])
    if kind == SMOOTHNESS_TERM:
        linear = record.linear - record.last_linear
        angular = record.angular - record.last_angular
        if p.drive == OMNIDIRECTIONAL:
            lateral = record.lateral - record.last_lateral
            return weight * (linear * linear + lateral * lateral + angular * angular)
        return weight * (linear * linear + angular * angular)
    if kind == SPEED_TERM:
        return weight * np.float32(robots.drawn[i, MAX_LINEAR]) * record.linear
    if kind == PEOPLE_TERM:
        return weight * max(ZERO, ONE - max(_from_movers(i, tile, robots, geometry, p), ZERO) / p.term_options[k])
    return ZERO


@kernel(fastmath=FAST, inline="always")
def reward(i, outcome, before, clearance, straight, tile, robots, geometry, p):
    """Write robot i's reward and its terms, formulas left out, for a step that began `before` metres from the target."""
    total = ZERO
    for k in range(p.terms):
        kind = p.term_kinds[k]
        term = ZERO
        if kind == ARRIVAL_TERM:
            term = p.term_weights[k] if outcome == ARRIVAL else ZERO
        elif kind == COLLISION_TERM:
            term = p.term_weights[k] if outcome == COLLISION else ZERO
        elif kind == TIMEOUT_TERM:
            term = p.term_weights[k] if outcome == TIMEOUT else ZERO
        elif outcome != ARRIVAL and outcome != COLLISION:
            term = _way_term(i, k, before, clearance, straight, tile, robots, geometry, p)
        robots.terms[i, k] = term
        total += term
    robots.rewards[i] = total
    robots.records[i].attempt_reward += total


@kernel(fastmath=FAST)
def tabulate(i, outcome, before, clearance, nearest, straight, tile, robots, geometry, p):
    """Write what formulas may read of robot i: the rows of `sim.extending.expression.QUANTITIES`."""
    record = robots.records[i]
    linear = np.float32(robots.drawn[i, MAX_LINEAR])
    angular = np.float32(robots.drawn[i, MAX_ANGULAR])
    table = robots.quantities
    table[0, i] = record.distance
    table[1, i] = before
    table[2, i] = _bearing(i, robots)
    table[3, i] = robots.poses[i, 2]
    table[4, i] = linear * record.linear
    table[5, i] = angular * record.angular
    table[6, i] = linear * record.last_linear
    table[7, i] = angular * record.last_angular
    if p.drive == ACKERMANN:
        most_linear = robots.drawn[i, MAX_LINEAR]
        most_angular = robots.drawn[i, MAX_ANGULAR]
        _, _, turn = twist(record.linear, record.lateral, record.angular, most_linear, most_angular, p)
        _, _, last_turn = twist(record.last_linear, record.last_lateral, record.last_angular, most_linear, most_angular, p)
        table[5, i] = np.float32(turn)
        table[7, i] = np.float32(last_turn)
    table[8, i] = clearance
    table[9, i] = _ahead(i, straight, robots)
    table[10, i] = nearest
    table[11, i] = _from_movers(i, tile, robots, geometry, p)
    table[12, i] = np.float32(record.steps)
    table[13, i] = ONE if outcome == ARRIVAL else ZERO
    table[14, i] = ONE if outcome == COLLISION else ZERO
    table[15, i] = ONE if outcome == TIMEOUT else ZERO


@kernel()
def _one(code, x):
    """A function of one value."""
    if code == NEGATIVE:
        return -x
    if code == ABS:
        return abs(x)
    if code == SQRT:
        return np.float32(math.sqrt(x)) if x >= ZERO else np.float32(math.nan)
    if code == EXP:
        return np.float32(math.exp(x))
    if code == LOG:
        return np.float32(math.log(x)) if x > ZERO else np.float32(math.nan)
    if code == SIN:
        return np.float32(math.sin(x))
    if code == COS:
        return np.float32(math.cos(x))
    return np.float32(math.tanh(x))


@kernel()
def _power(x, y):
    """X to the power of y; not a number where that is no real one."""
    if x < ZERO and y != np.float32(math.floor(y)):
        return np.float32(math.nan)
    return np.float32(np.float64(x) ** np.float64(y))


@kernel()
def _two(code, x, y):
    """An operation on two values; comparisons are 1 where they hold."""
    if code == DIVIDE:
        return x / y
    if code == POWER:
        return _power(x, y)
    if code == LESS:
        return ONE if x < y else ZERO
    if code == LESS_EQUAL:
        return ONE if x <= y else ZERO
    if code == GREATER:
        return ONE if x > y else ZERO
    if code == GREATER_EQUAL:
        return ONE if x >= y else ZERO
    if code == MIN:
        return min(x, y)
    return max(x, y)


@kernel()
def _row(code, first, second, count):
    """The commonest operations on two rows, `first` overwritten: loops without a branch, which run many lanes at a time."""
    if code == ADD:
        for i in range(count):
            first[i] += second[i]
    elif code == SUBTRACT:
        for i in range(count):
            first[i] -= second[i]
    elif code == MULTIPLY:
        for i in range(count):
            first[i] *= second[i]
    else:
        for i in range(count):
            first[i] = _two(code, first[i], second[i])


@kernel()
def add_formula(codes, numbers, stack, weight, column, robots):
    """Compute a formula for all robots at once, and add it to their rewards.

    Args:
        codes: (L,) int32 operations, operands before their operator; those of constants are numbers here.
        numbers: (L,) float32 what numbers push, or the row of a quantity.
        stack: (depth, N) float32 scratch.
        weight: of the term.
        column: of `robots.terms`.
        robots: `sim.kernels.bundles.Robots`.

    Returns:
        -1, or the first robot for which the formula is not a finite number; rewards are then left as they were.
    """
    count = robots.rewards.shape[0]
    top = -1
    for k in range(codes.shape[0]):
        code = codes[k]
        if code == NUMBER:
            top += 1
            for i in range(count):
                stack[top, i] = numbers[k]
        elif code == QUANTITY:
            top += 1
            row = int(numbers[k])
            for i in range(count):
                stack[top, i] = robots.quantities[row, i]
        elif code == IF:
            top -= 2
            for i in range(count):
                stack[top, i] = stack[top + 1, i] if stack[top, i] != ZERO else stack[top + 2, i]
        elif code == CLIP:
            top -= 2
            for i in range(count):
                stack[top, i] = min(max(stack[top, i], stack[top + 1, i]), stack[top + 2, i])
        elif code == NEGATIVE or ABS <= code <= TANH:
            for i in range(count):
                stack[top, i] = _one(code, stack[top, i])
        else:
            top -= 1
            _row(code, stack[top], stack[top + 1], count)
    for i in range(count):
        if not robots.records[i].parked and not math.isfinite(weight * stack[0, i]):
            return i
    for i in range(count):
        term = ZERO if robots.records[i].parked else weight * stack[0, i]
        robots.terms[i, column] = term
        robots.rewards[i] += term
        robots.records[i].attempt_reward += term
    return -1
