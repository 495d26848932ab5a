"""After the physics of a step: outcomes, rewards, observations and resets."""

import math
from typing import Any

import numpy as np

from sim.kernels.commands import twist
from sim.kernels.disturbances import begin_episode, drift, find_itself, perceive
from sim.kernels.footprint import moving_rectangle_clearance, swept_rectangle_clearance
from sim.kernels.observing import observe, observe_ways, repeat_first
from sim.kernels.options import kernel
from sim.kernels.random import uniform
from sim.kernels.records import (
    ARRIVAL,
    CELL,
    COLLISION,
    MAX_ANGULAR,
    MAX_LINEAR,
    NONE,
    TIMEOUT,
)
from sim.kernels.rewards import ahead_of_mounts, reward, tabulate
from sim.kernels.sensing import FAR, FAST, clearance_at, disc_clearance, nearest_of, sense, sense_discs, swept_clearance
from sim.kernels.together import see_others_placed

ZERO = np.float32(0.0)
ONE = np.float32(1.0)
MINUS_ONE = np.float32(-1.0)
PI = np.float32(math.pi)
_CELL = np.float32(CELL)

MIN_TARGET_DISTANCE = np.float32(0.5)
"""A new target is at least this far away, metres: a nearer one would count as an arrival almost at once."""

ARRIVAL_MARGIN = 0.1
"""And this far beyond the distance that counts as arrived, metres: nobody arrives without driving."""

MOVER_ROOM = np.float32(1.1)
"""Metres that a robot's centre starts away from every mover's surface."""

MOST_TURNED = 100.0
"""Radians from which on a robot's angle in the Space, where it adds up over an episode, is brought back to [-pi, pi]."""

SPAWN_TRIES = 200
"""Draws before a start or target is taken as it is; the cells are free, so one in three or so is good."""


@kernel(inline="always")
def _distance_to_target(i, robots):
    """Metres from robot i to its target."""
    dx = robots.targets[i, 0] - robots.poses[i, 0]
    dy = robots.targets[i, 1] - robots.poses[i, 1]
    return np.float32(math.sqrt(dx * dx + dy * dy))


@kernel()
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
        x = geometry.targets[cell, 0] + _CELL * np.float32(uniform(records, i))
        y = geometry.targets[cell, 1] + _CELL * np.float32(uniform(records, i))
        robots.targets[i, 0] = x
        robots.targets[i, 1] = y
        if _distance_to_target(i, robots) < p.min_target_distance:
            continue
        if clearance_at(x, y, index, geometry.bounds, geometry.circles, geometry.boxes) >= p.spawn_clearance:
            break
    records[i].distance = _distance_to_target(i, robots)


@kernel()
def _draw_start(i, robots, geometry, p, state):
    """Put robot i, at rest, somewhere free in an arena of the pool; who belongs to a group stays in its arena."""
    records = robots.records
    if geometry.starts.shape[0] == 0:
        return
    arenas = geometry.bounds.shape[0]
    if arenas > 1 and p.together == 1:
        drawn = uniform(records, i)
        if geometry.chances.shape[0]:
            records[i].map = np.int32(np.searchsorted(geometry.chances, drawn, side="right"))
        else:
            records[i].map = np.int32(drawn * arenas)
    index = records[i].map
    first = geometry.start_offsets[index]
    cells = geometry.start_offsets[index + 1] - first
    x = ZERO
    y = ZERO
    tile = records[i].replica * p.replica_stride + index
    for _ in range(SPAWN_TRIES):
        cell = first + np.int64(uniform(records, i) * cells)
        x = geometry.starts[cell, 0] + _CELL * np.float32(uniform(records, i))
        y = geometry.starts[cell, 1] + _CELL * np.float32(uniform(records, i))
        if disc_clearance(x, y, tile, geometry.discs) < MOVER_ROOM:
            continue
        if clearance_at(x, y, index, geometry.bounds, geometry.circles, geometry.boxes) >= p.spawn_clearance:
            break
    heading = np.float32((2.0 * uniform(records, i) - 1.0) * math.pi)
    _place(i, x, y, heading, robots, geometry, p, state)


@kernel()
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
    robots.records[i].last_linear = ZERO
    robots.records[i].last_angular = ZERO
    robots.records[i].lateral = ZERO
    robots.records[i].last_lateral = ZERO


@kernel()
def _forget_attempt(record):
    """Start counting anew."""
    record.steps = 0
    record.attempt_reward = 0.0
    record.path_length = 0.0
    record.min_clearance = ZERO  # the first step sets it


@kernel()
def _nothing_happened(i, robots):
    """Clear the results of robot i's step."""
    robots.outcomes[i] = NONE
    robots.rewards[i] = ZERO
    robots.terms[i, :] = ZERO
    robots.terminations[i] = False
    robots.truncations[i] = False


@kernel()
def reset_robots(which, poses, targets, robots, geometry, parameters, state):
    """Begin a new episode for some robots.

    Args:
        which: (N,) bool, the robots.
        poses: (N, 3) float32 where each robot starts; NaN in the first column draws one.
        targets: (N, 2) float32 where each robot shall go; NaN in the first column draws one.
        robots: `sim.kernels.bundles.Robots`, whose arrays are written.
        geometry: `sim.kernels.bundles.Geometry`.
        parameters: (1,) PARAMETERS.
        state: (bodies, 3) x, y, angle in the Space; written.
    """
    p = parameters[0]
    for i in range(poses.shape[0]):
        if not which[i]:
            continue
        if p.together > 1:
            see_others_placed(i, which, i, robots, geometry, p)
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
    # Who sees the others begins once all of them have their places.
    for i in range(poses.shape[0]):
        if p.together > 1:
            see_others_placed(i, which, poses.shape[0], robots, geometry, p)
        if not which[i]:
            continue
        begin_episode(i, robots, geometry, p)
        _sense_as_mounted(i, robots, geometry, p)
        if p.perceives:
            perceive(i, robots, p)
        observe(i, robots, geometry, p)
        observe_ways(i, robots, geometry, p)
        repeat_first(i, robots, p)


@kernel(inline="always")
def _scanner_of(i, robots):
    """Row of `ray_cos`, `ray_sin` and `ahead` that is robot i's: the only one where all scanners are alike."""
    return i if robots.ahead.shape[0] > 1 else 0


@kernel()
def _sense_from_mounts(i, robots, geometry, p):
    """Scan by robot i's LiDARs, where they stand elsewhere; returns the clearance of its middle, metres."""
    x = robots.poses[i, 0]
    y = robots.poses[i, 1]
    cos_heading = np.float32(math.cos(robots.poses[i, 2]))
    sin_heading = np.float32(math.sin(robots.poses[i, 2]))
    index = robots.records[i].map
    tile = robots.records[i].replica * p.replica_stride + index
    own = _scanner_of(i, robots)
    room = geometry.scan.shape[0]
    rays = geometry.ray_angles.shape[0]
    for s in range(p.lidars):
        ahead = np.float32(p.mounts[s, 0])
        aside = np.float32(p.mounts[s, 1])
        from_x = x + cos_heading * ahead - sin_heading * aside
        from_y = y + sin_heading * ahead + cos_heading * aside
        clearance = sense(
            from_x, from_y, cos_heading, sin_heading, index, geometry.bounds, geometry.circles, geometry.boxes,
            robots.ray_cos[own, s * room : (s + 1) * room], robots.ray_sin[own, s * room : (s + 1) * room],
            p.range, p.looks_ahead, geometry.scan, geometry.ray_x, geometry.ray_y, geometry.near,
        )  # fmt: skip
        sense_discs(
            from_x, from_y, cos_heading, sin_heading, tile, geometry.discs, p.range, p.looks_ahead,
            geometry.scan, geometry.ray_x, geometry.ray_y, geometry.near, clearance,
        )  # fmt: skip
        for k in range(rays):
            robots.ranges[i, s * rays + k] = geometry.scan[k]
    clearance = clearance_at(x, y, index, geometry.bounds, geometry.circles, geometry.boxes)
    return min(clearance, disc_clearance(x, y, tile, geometry.discs))


@kernel()
def _nearest_to_middle(i, robots, geometry, p):
    """Distance of the nearest thing that robot i's rays meet from the middle of its body, metres."""
    own = _scanner_of(i, robots)
    room = geometry.scan.shape[0]
    rays = geometry.ray_angles.shape[0]
    nearest = FAR
    for s in range(p.lidars):
        for k in range(rays):
            seen = robots.ranges[i, s * rays + k]
            if seen < p.range:
                ahead = np.float32(p.mounts[s, 0]) + seen * robots.ray_cos[own, s * room + k]
                aside = np.float32(p.mounts[s, 1]) + seen * robots.ray_sin[own, s * room + k]
                nearest = min(nearest, np.float32(math.sqrt(ahead * ahead + aside * aside)))
    return nearest


@kernel()
def _motion(i, robots, p):
    """How robot i moved in this step: speeds forwards and to the left, m/s, and turning rate, rad/s."""
    record = robots.records[i]
    return twist(
        record.linear, record.lateral, record.angular, robots.drawn[i, MAX_LINEAR], robots.drawn[i, MAX_ANGULAR], p
    )  # fmt: skip


@kernel(inline="always")
def _sense(i, robots, geometry, p):
    """Scan from robot i's pose by the LiDAR in its middle; returns the clearance of that, metres."""
    x = robots.poses[i, 0]
    y = robots.poses[i, 1]
    cos_heading = np.float32(math.cos(robots.poses[i, 2]))
    sin_heading = np.float32(math.sin(robots.poses[i, 2]))
    index = robots.records[i].map
    own = _scanner_of(i, robots)
    clearance = sense(
        x, y, cos_heading, sin_heading, index, geometry.bounds, geometry.circles, geometry.boxes, robots.ray_cos[own],
        robots.ray_sin[own], p.range, p.looks_ahead, geometry.scan, geometry.ray_x, geometry.ray_y, geometry.near,
    )  # fmt: skip
    tile = robots.records[i].replica * p.replica_stride + index
    clearance = sense_discs(
        x, y, cos_heading, sin_heading, tile, geometry.discs, p.range, p.looks_ahead,
        geometry.scan, geometry.ray_x, geometry.ray_y, geometry.near, clearance,
    )  # fmt: skip
    for k in range(robots.ranges.shape[1]):
        robots.ranges[i, k] = geometry.scan[k]
    return clearance


@kernel()
def _sense_as_mounted(i, robots, geometry, p):
    """Scan from robot i's pose by its LiDARs, wherever they are; returns the clearance of its middle, metres."""
    if p.mounted:
        return _sense_from_mounts(i, robots, geometry, p)
    return _sense(i, robots, geometry, p)


@kernel(fastmath=FAST, inline="always")
def _clearance_on_the_way(i, x, y, clearance, robots, geometry, p):
    """`clearance` or, where it is smaller, that of points between (x, y) and robot i's pose, metres."""
    for k in range(1, p.path_samples):
        part = np.float32(k) / np.float32(p.path_samples)
        px = x + part * (robots.poses[i, 0] - x)
        py = y + part * (robots.poses[i, 1] - y)
        here = clearance_at(px, py, robots.records[i].map, geometry.bounds, geometry.circles, geometry.boxes)
        clearance = min(clearance, here)
    return clearance


@kernel(fastmath=FAST, inline="always")
def _clearance_from_passing(i, last_x, last_y, clearance, tile, robots, geometry, p):
    """`clearance` or, where it is smaller, that of robot i's body from movers while all came where they are now, metres."""
    x = robots.poses[i, 0]
    y = robots.poses[i, 1]
    dx = x - last_x
    dy = y - last_y
    if p.half_length > ZERO:
        return swept_rectangle_clearance(
            x, y, robots.poses[i, 2], dx, dy, tile, geometry.discs, p.closing, p.half_length, p.half_width, clearance
        )  # fmt: skip
    if clearance < p.closing:
        clearance = min(clearance, swept_clearance(x, y, dx, dy, tile, geometry.discs) - p.radius)
    return clearance


def _steps(*, usual: bool) -> Any:
    """The kernel of a step, compiled for the usual robot alone or for every robot.

    What drives and mounts of other robots need costs the usual one a fifth of its rate where it only stands beside it.

    Args:
        usual: whether the drive is differential, the only LiDAR looks ahead from the body's middle, and neither its trail
            nor ways ahead are seen.
    """

    @kernel(fastmath=FAST)
    def step_robots(first, last, state, placed, robots, geometry, parameters):
        """Everything that follows the physics of a step, for some robots; others may be another thread's at the same time.

        Args:
            first: of these robots.
            last: the one after them.
            state: (bodies, 3) x, y, angle in the Space; rows of robots that start anew, or have turned far, are overwritten.
            placed: (N,) int32, written from `first` on: which rows were.
            robots: `sim.kernels.bundles.Robots`, whose arrays are updated.
            geometry: `sim.kernels.bundles.Geometry`, whose scratch no other thread writes.
            parameters: (1,) PARAMETERS.

        Returns:
            How many rows of `state` were overwritten.
        """
        p = parameters[0]
        records = robots.records
        count = 0
        for i in range(first, last):
            if records[i].parked:
                _nothing_happened(i, robots)
                continue
            if robots.outcomes[i] != NONE:
                _forget_attempt(records[i])
            tile = records[i].replica * p.replica_stride + records[i].map
            x = np.float32(state[i, 0] - geometry.origins[tile, 0])
            y = np.float32(state[i, 1] - geometry.origins[tile, 1])
            heading = state[i, 2]
            if abs(heading) > math.pi:
                heading -= 2.0 * math.pi * math.floor((heading + math.pi) / (2.0 * math.pi))
            overwritten = abs(state[i, 2]) > MOST_TURNED
            if overwritten:
                state[i, 2] = heading
            last_x = robots.poses[i, 0]
            last_y = robots.poses[i, 1]
            last_heading = robots.poses[i, 2]
            robots.poses[i, 0] = x
            robots.poses[i, 1] = y
            robots.poses[i, 2] = np.float32(heading)
            if p.drifts:
                if usual:
                    turn = robots.drawn[i, MAX_ANGULAR] * records[i].angular * p.period
                else:
                    turn = _motion(i, robots, p)[2] * p.period
                drift(i, np.float64(x - last_x), np.float64(y - last_y), turn, robots)

            clearance = _sense(i, robots, geometry, p) if usual else _sense_as_mounted(i, robots, geometry, p)
            if p.half_length > ZERO:
                clearance = moving_rectangle_clearance(
                    last_x, last_y, last_heading, x, y, robots.poses[i, 2], records[i].map,
                    geometry.bounds, geometry.circles, geometry.boxes, p.half_length, p.half_width, p.path_samples,
                )  # fmt: skip
            else:
                if p.path_samples > 1:
                    clearance = _clearance_on_the_way(i, last_x, last_y, clearance, robots, geometry, p)
                clearance -= p.radius
            if geometry.discs.shape[1]:
                clearance = _clearance_from_passing(i, last_x, last_y, clearance, tile, robots, geometry, p)
            nearest = nearest_of(robots.ranges, i, 0, robots.ranges.shape[1])
            reached = nearest
            if not usual and p.mounted:
                reached = _nearest_to_middle(i, robots, geometry, p)
            before = records[i].distance
            records[i].distance = _distance_to_target(i, robots)
            records[i].steps += 1
            if usual:
                records[i].path_length += abs(robots.drawn[i, MAX_LINEAR] * records[i].linear) * p.period
            else:
                forwards, aside, _ = _motion(i, robots, p)
                records[i].path_length += math.sqrt(forwards * forwards + aside * aside) * p.period
            if records[i].steps == 1 or clearance < records[i].min_clearance:
                records[i].min_clearance = clearance

            outcome = NONE
            if records[i].distance < p.arrival_distance:
                outcome = ARRIVAL
            elif clearance < ZERO or reached < p.collision_distance:
                outcome = COLLISION
            elif records[i].steps >= p.step_limit:
                outcome = TIMEOUT
            robots.outcomes[i] = outcome
            ended = outcome in (COLLISION, TIMEOUT) or (outcome == ARRIVAL and p.arrival_ends)
            robots.terminations[i] = ended and outcome != TIMEOUT
            robots.truncations[i] = outcome == TIMEOUT
            # Where it takes more than a look at neighbouring rays; found among the rewards, it would slow every robot.
            straight = MINUS_ONE
            if not usual and p.mounted:
                straight = ahead_of_mounts(i, robots, geometry, p)
            reward(i, outcome, before, clearance, straight, tile, robots, geometry, p)
            if p.tabulates:
                tabulate(i, outcome, before, clearance, nearest, straight, tile, robots, geometry, p)

            # Outcomes and rewards are of the world as it is; the robot gets to see less.
            if p.perceives:
                perceive(i, robots, p)
            if outcome == ARRIVAL and not ended:
                _draw_target(i, robots, geometry, p)
                find_itself(i, robots)
            observe(i, robots, geometry, p)
            if not usual:
                observe_ways(i, robots, geometry, p)
            if ended:
                for k in range(robots.observations.shape[1]):
                    robots.final_observations[i, k] = robots.observations[i, k]
            if ended and p.starts_anew:
                _draw_start(i, robots, geometry, p, state)
                overwritten = True
                _draw_target(i, robots, geometry, p)
                begin_episode(i, robots, geometry, p)
                if usual:
                    _sense(i, robots, geometry, p)
                else:
                    _sense_as_mounted(i, robots, geometry, p)
                if p.perceives:
                    perceive(i, robots, p)
                observe(i, robots, geometry, p)
                if not usual:
                    observe_ways(i, robots, geometry, p)
                repeat_first(i, robots, p)
            if overwritten:
                placed[first + count] = i
                count += 1
        return count

    return step_robots


step_usual_robots = _steps(usual=True)
"""Everything that follows the physics of a step, for a differential drive whose only LiDAR looks ahead from its middle, and
who sees no trail."""

step_any_robots = _steps(usual=False)
"""The same for every drive and every mount, trails included."""
