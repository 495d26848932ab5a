"""One control step around the physics: commands before it; outcomes, rewards, observations and resets after it."""

import math

import numba as nb
import numpy as np

from sim.kernels.random import uniform
from sim.kernels.records import (
    ALIGNMENT,
    ARRIVAL,
    BASIC,
    CLEARANCE,
    COLLISION,
    NONE,
    PAPER,
    TIMEOUT,
)
from sim.kernels.sensing import FAST, clearance_at, nearest_of, sense

ZERO = np.float32(0.0)
ONE = np.float32(1.0)
PI = np.float32(math.pi)
TWO_PI = np.float32(2.0 * math.pi)
CELL = np.float32(0.1)  # sim.arenas.freespace.CELL

MIN_TARGET_DISTANCE = np.float32(0.5)
"""A new target is at least this far away, metres: a nearer one would count as an arrival almost at once."""

MAX_RATIO = np.float32(8.0)
"""Cap of d_{t-1}/d_t in the advanced reward, which would overflow when a robot stands on its target."""

SPAWN_TRIES = 200
"""Draws before a start or target is taken as it is; the cells are free, so one in three or so is good."""

_SERIES = 1e-4
"""Below this half angle sin(h)/h is 1 - h²/6 to the last bit."""


@nb.njit(cache=True, nogil=True, error_model="numpy")
def write_commands(actions, records, state, command, parameters):
    """Turn actions into the bodies' velocities.

    The velocity points along the chord of the arc that the robot drives in one period, so that one explicit step of the
    physics ends exactly on the arc (plain Euler is 48 mm off after 10 s).

    Args:
        actions: (N, 2) linear in [0, 1] and angular in [-1, 1], as fractions of the limits; clipped.
        records: (N,) ROBOT.
        state: (bodies, 3) x, y, angle in the Space.
        command: (bodies, 6) x, y, angle, vx, vy, angular velocity; the first N rows are written.
        parameters: (1,) PARAMETERS.

    Returns:
        -1, or the first robot whose action is not finite; nothing is written for it and those after it.
    """
    p = parameters[0]
    for i in range(actions.shape[0]):
        for k in range(3):
            command[i, k] = state[i, k]
            command[i, 3 + k] = 0.0
        if records[i].parked:
            continue
        linear = actions[i, 0]
        angular = actions[i, 1]
        if not (math.isfinite(linear) and math.isfinite(angular)):
            return i
        linear = min(max(linear, ZERO), ONE)
        angular = min(max(angular, -ONE), ONE)
        linear = min(max(linear, records[i].linear - p.linear_change), records[i].linear + p.linear_change)
        angular = min(max(angular, records[i].angular - p.angular_change), records[i].angular + p.angular_change)
        records[i].linear = linear
        records[i].angular = angular
        turn = p.max_angular * angular
        half = 0.5 * turn * p.period
        chord = math.sin(half) / half if abs(half) > _SERIES else 1.0 - half * half / 6.0
        speed = p.max_linear * linear * chord
        direction = state[i, 2] + half
        command[i, 3] = speed * math.cos(direction)
        command[i, 4] = speed * math.sin(direction)
        command[i, 5] = turn
    return -1


@nb.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _bearing(dx, dy, heading):
    """Direction of (dx, dy) against the heading, in [-pi, pi], left positive."""
    bearing = np.float32(math.atan2(dy, dx)) - heading
    if bearing > PI:
        bearing -= TWO_PI
    elif bearing < -PI:
        bearing += TWO_PI
    return min(max(bearing, -PI), PI)


@nb.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST, inline="always")
def _observe(i, robots, geometry, p):
    """Write robot i's observation; `sim.observations` says what each number is."""
    record = robots.records[i]
    out = robots.observations
    rays = p.rays_per_batch
    paper = p.observation == PAPER
    for k in range(p.batches):
        nearest = nearest_of(robots.ranges, i, k * rays, (k + 1) * rays)
        out[i, k] = nearest / p.range if paper else p.near / max(nearest, p.near)
    k = p.batches
    out[i, k] = record.linear
    out[i, k + 1] = record.angular
    heading = robots.poses[i, 2]
    dx = robots.targets[i, 0] - robots.poses[i, 0]
    dy = robots.targets[i, 1] - robots.poses[i, 1]
    bearing = _bearing(dx, dy, heading)
    if paper:
        width = geometry.bounds[record.map, 0]
        height = geometry.bounds[record.map, 1]
        direction = np.float32(math.atan2(dy, dx))
        out[i, k + 2] = record.distance / (np.float32(2.0) * np.float32(math.sqrt(width * width + height * height)))
        out[i, k + 3] = (direction if direction >= ZERO else direction + TWO_PI) / TWO_PI
        out[i, k + 4] = (heading if heading >= ZERO else heading + TWO_PI) / TWO_PI
    else:
        out[i, k + 2] = record.distance / (record.distance + ONE)
        out[i, k + 3] = bearing / PI
        out[i, k + 4] = heading / PI
    out[i, k + 5] = abs(bearing) / PI


@nb.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _distance_to_target(i, robots):
    """Metres from robot i to its target."""
    dx = robots.targets[i, 0] - robots.poses[i, 0]
    dy = robots.targets[i, 1] - robots.poses[i, 1]
    return np.float32(math.sqrt(dx * dx + dy * dy))


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _draw_target(i, robots, geometry, p):
    """Give robot i a new target: uniform in its arena's target cells, clear of obstacles, not next to the robot."""
    records = robots.records
    index = records[i].map
    first = geometry.target_offsets[index]
    cells = geometry.target_offsets[index + 1] - first
    if cells == 0:
        return
    for _ in range(SPAWN_TRIES):
        cell = first + np.int64(uniform(records, i) * cells)
        x = geometry.targets[cell, 0] + CELL * np.float32(uniform(records, i))
        y = geometry.targets[cell, 1] + CELL * np.float32(uniform(records, i))
        robots.targets[i, 0] = x
        robots.targets[i, 1] = y
        if _distance_to_target(i, robots) < MIN_TARGET_DISTANCE:
            continue
        if clearance_at(x, y, index, geometry.bounds, geometry.circles, geometry.boxes) >= p.spawn_clearance:
            break
    records[i].distance = _distance_to_target(i, robots)


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _draw_start(i, robots, geometry, p, state):
    """Put robot i, at rest, somewhere free in an arena of the pool."""
    records = robots.records
    if geometry.starts.shape[0] == 0:
        return
    arenas = geometry.bounds.shape[0]
    if arenas > 1:
        records[i].map = np.int32(uniform(records, i) * arenas)
    index = records[i].map
    first = geometry.start_offsets[index]
    cells = geometry.start_offsets[index + 1] - first
    x = ZERO
    y = ZERO
    for _ in range(SPAWN_TRIES):
        cell = first + np.int64(uniform(records, i) * cells)
        x = geometry.starts[cell, 0] + CELL * np.float32(uniform(records, i))
        y = geometry.starts[cell, 1] + CELL * np.float32(uniform(records, i))
        if clearance_at(x, y, index, geometry.bounds, geometry.circles, geometry.boxes) >= p.spawn_clearance:
            break
    heading = np.float32((2.0 * uniform(records, i) - 1.0) * math.pi)
    _place(i, x, y, heading, robots, geometry, p, state)


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _place(i, x, y, heading, robots, geometry, p, state):
    """Put robot i, at rest, at a pose in its arena."""
    tile = robots.records[i].replica * p.replica_stride + robots.records[i].map
    robots.poses[i, 0] = x
    robots.poses[i, 1] = y
    robots.poses[i, 2] = heading
    state[i, 0] = geometry.origins[tile, 0] + x
    state[i, 1] = geometry.origins[tile, 1] + y
    state[i, 2] = heading
    robots.records[i].linear = ZERO
    robots.records[i].angular = ZERO


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _forget_attempt(record):
    """Start counting anew."""
    record.steps = 0
    record.attempt_reward = 0.0
    record.path_length = 0.0
    record.min_clearance = ZERO  # the first step sets it


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _nothing_happened(i, robots):
    """Clear the results of robot i's step."""
    robots.outcomes[i] = NONE
    robots.rewards[i] = ZERO
    robots.terms[i, :] = ZERO
    robots.terminations[i] = False
    robots.truncations[i] = False


@nb.njit(cache=True, nogil=True, error_model="numpy")
def reset_robots(poses, targets, robots, geometry, parameters, state):
    """Begin a new episode for every robot.

    Args:
        poses: (N, 3) float32 where each robot starts; NaN in the first column draws one.
        targets: (N, 2) float32 where each robot shall go; NaN in the first column draws one.
        robots: `sim.kernels.bundles.Robots`, whose arrays are written.
        geometry: `sim.kernels.bundles.Geometry`.
        parameters: (1,) PARAMETERS.
        state: (bodies, 3) x, y, angle in the Space; written.
    """
    p = parameters[0]
    dx = np.empty(geometry.ray_cos.shape[0], np.float32)
    dy = np.empty(geometry.ray_cos.shape[0], np.float32)
    for i in range(poses.shape[0]):
        if math.isnan(poses[i, 0]):
            _draw_start(i, robots, geometry, p, state)
        else:
            _place(i, poses[i, 0], poses[i, 1], poses[i, 2], robots, geometry, p, state)
        if math.isnan(targets[i, 0]):
            _draw_target(i, robots, geometry, p)
        else:
            robots.targets[i, 0] = targets[i, 0]
            robots.targets[i, 1] = targets[i, 1]
            robots.records[i].distance = _distance_to_target(i, robots)
        _forget_attempt(robots.records[i])
        _nothing_happened(i, robots)
        _sense(i, robots, geometry, p, dx, dy)
        _disturb(i, robots, p)
        _observe(i, robots, geometry, p)


@nb.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _sense(i, robots, geometry, p, dx, dy):
    """Scan from robot i's pose; returns the clearance of its centre, metres."""
    return sense(
        robots.poses[i, 0], robots.poses[i, 1], robots.poses[i, 2], robots.records[i].map,
        geometry.bounds, geometry.circles, geometry.boxes, geometry.ray_cos, geometry.ray_sin,
        p.range, p.looks_ahead, robots.ranges, i, dx, dy,
    )  # fmt: skip


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _disturb(i, robots, p):
    """Add the LiDAR's noise and dropouts to robot i's scan."""
    if p.noise == ZERO and p.dropout == ZERO:
        return
    for k in range(robots.ranges.shape[1]):
        if robots.ranges[i, k] >= p.range:
            continue
        if p.noise > ZERO:
            # Box and Muller (1958); 1 - u keeps the logarithm finite.
            size = math.sqrt(-2.0 * math.log(1.0 - uniform(robots.records, i)))
            disturbance = np.float32(size * math.cos(2.0 * math.pi * uniform(robots.records, i)))
            robots.ranges[i, k] = min(max(robots.ranges[i, k] + p.noise * disturbance, ZERO), p.range)
        if p.dropout > ZERO and uniform(robots.records, i) < p.dropout:
            robots.ranges[i, k] = p.range


@nb.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST, inline="always")
def _clearance_on_the_way(i, x, y, clearance, robots, geometry, p):
    """`clearance` or, where it is smaller, that of points between (x, y) and robot i's pose, metres."""
    for k in range(1, p.path_samples):
        part = np.float32(k) / np.float32(p.path_samples)
        px = x + part * (robots.poses[i, 0] - x)
        py = y + part * (robots.poses[i, 1] - y)
        here = clearance_at(px, py, robots.records[i].map, geometry.bounds, geometry.circles, geometry.boxes)
        clearance = min(clearance, here)
    return clearance


@nb.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST, inline="always")
def _reward(i, outcome, before, robots, p):
    """Write robot i's reward and its terms for a step that began `before` metres from the target."""
    terms = robots.terms
    for k in range(terms.shape[1]):
        terms[i, k] = ZERO
    if outcome == ARRIVAL:
        terms[i, 0] = p.arrival_reward
    elif outcome == COLLISION:
        terms[i, 1] = p.collision_reward
    else:
        now = robots.records[i].distance
        gained = p.progress * (before - now)
        if p.reward == BASIC:
            terms[i, 2] = gained
        else:
            ratio = MAX_RATIO if now * MAX_RATIO <= before else before / now
            terms[i, 2] = gained * np.float32(2.0**ratio)
            safety = ZERO
            if p.reward == CLEARANCE:
                safety = nearest_of(robots.ranges, i, p.ahead_first, p.ahead_last) / p.range
            elif p.reward == ALIGNMENT:
                dx = robots.targets[i, 0] - robots.poses[i, 0]
                dy = robots.targets[i, 1] - robots.poses[i, 1]
                safety = ONE - abs(_bearing(dx, dy, robots.poses[i, 2])) / PI
            terms[i, 3] = -p.penalty * (ONE - safety)
    robots.rewards[i] = terms[i, 0] + terms[i, 1] + terms[i, 2] + terms[i, 3]
    robots.records[i].attempt_reward += robots.rewards[i]


@nb.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def step_robots(state, robots, geometry, parameters):
    """Everything that follows the physics of a step.

    Args:
        state: (bodies, 3) x, y, angle in the Space; rows of robots that start anew are overwritten.
        robots: `sim.kernels.bundles.Robots`, whose arrays are updated.
        geometry: `sim.kernels.bundles.Geometry`.
        parameters: (1,) PARAMETERS.
    """
    p = parameters[0]
    dx = np.empty(geometry.ray_cos.shape[0], np.float32)
    dy = np.empty(geometry.ray_cos.shape[0], np.float32)
    records = robots.records
    for i in range(records.shape[0]):
        if records[i].parked:
            _nothing_happened(i, robots)
            continue
        if robots.outcomes[i] != NONE:
            _forget_attempt(records[i])
        tile = records[i].replica * p.replica_stride + records[i].map
        x = np.float32(state[i, 0] - geometry.origins[tile, 0])
        y = np.float32(state[i, 1] - geometry.origins[tile, 1])
        if abs(state[i, 2]) > math.pi:
            state[i, 2] -= 2.0 * math.pi * math.floor((state[i, 2] + math.pi) / (2.0 * math.pi))
        last_x = robots.poses[i, 0]
        last_y = robots.poses[i, 1]
        robots.poses[i, 0] = x
        robots.poses[i, 1] = y
        robots.poses[i, 2] = np.float32(state[i, 2])

        clearance = _sense(i, robots, geometry, p, dx, dy)
        if p.path_samples > 1:
            clearance = _clearance_on_the_way(i, last_x, last_y, clearance, robots, geometry, p)
        clearance -= p.radius
        nearest = nearest_of(robots.ranges, i, 0, robots.ranges.shape[1])
        before = records[i].distance
        records[i].distance = _distance_to_target(i, robots)
        records[i].steps += 1
        records[i].path_length += p.max_linear * records[i].linear * p.period
        if records[i].steps == 1 or clearance < records[i].min_clearance:
            records[i].min_clearance = clearance

        outcome = NONE
        if records[i].distance < p.arrival_distance:
            outcome = ARRIVAL
        elif clearance < ZERO or nearest < p.collision_distance:
            outcome = COLLISION
        elif records[i].steps >= p.step_limit:
            outcome = TIMEOUT
        robots.outcomes[i] = outcome
        robots.terminations[i] = outcome == COLLISION
        robots.truncations[i] = outcome == TIMEOUT
        _reward(i, outcome, before, robots, p)

        # Outcomes and rewards are of the world as it is; the robot gets to see less.
        _disturb(i, robots, p)
        if outcome == ARRIVAL:
            _draw_target(i, robots, geometry, p)
        _observe(i, robots, geometry, p)
        if outcome in (COLLISION, TIMEOUT):
            for k in range(robots.observations.shape[1]):
                robots.final_observations[i, k] = robots.observations[i, k]
            _draw_start(i, robots, geometry, p, state)
            _draw_target(i, robots, geometry, p)
            _sense(i, robots, geometry, p, dx, dy)
            _disturb(i, robots, p)
            _observe(i, robots, geometry, p)
