"""What a robot is told: the numbers that `sim.observations` explains."""

import math

import numpy as np

from sim.kernels.dwell import see_dwell
from sim.kernels.known import see_known
from sim.kernels.openings import see_openings
from sim.kernels.options import kernel
from sim.kernels.reach import see_reach
from sim.kernels.records import (
    ACTIONS_PART,
    BEARING_PART,
    DEVIATION_PART,
    DIRECTION_PART,
    DISTANCE_PART,
    DWELL_PART,
    HEADING_PART,
    KNOWN_PART,
    OMNIDIRECTIONAL,
    OPENINGS_PART,
    RANGES_PART,
    REACH_PART,
    SPEEDS_PART,
    TRAIL_PART,
    WAY_PART,
)
from sim.kernels.sensing import FAST, nearest_of
from sim.kernels.trail import see_trail
from sim.kernels.views import keep_view
from sim.kernels.way import see_way

ZERO = np.float32(0.0)
ONE = np.float32(1.0)
PI = np.float32(math.pi)
TWO_PI = np.float32(2.0 * math.pi)


@kernel(fastmath=FAST)
def wrapped(angle):
    """An angle of less than one and a half turns in [-pi, pi]."""
    if angle > PI:
        angle -= TWO_PI
    elif angle < -PI:
        angle += TWO_PI
    return min(max(angle, -PI), PI)


@kernel(fastmath=FAST)
def bearing_of(dx, dy, heading):
    """Direction of (dx, dy) against the heading, in [-pi, pi], left positive."""
    return wrapped(np.float32(math.atan2(dy, dx)) - heading)


@kernel(fastmath=FAST, inline="always")
def _see_ranges(i, robots, p):
    """Write the nearest ray of each batch."""
    out = robots.observations
    at = p.part_places[RANGES_PART]
    rays = p.rays_per_batch
    inverse = p.part_options[RANGES_PART]
    for k in range(p.batches):
        nearest = nearest_of(robots.ranges, i, k * rays, (k + 1) * rays)
        # One loop for both: apart from one another, the compiler would divide by multiplying, which rounds otherwise.
        out[i, at + k] = p.near / max(nearest, p.near) if inverse else nearest / p.range


@kernel(fastmath=FAST, inline="always")
def _grow_older(i, robots, p):
    """Move what robot i saw at each moment to where the moment before it was."""
    out = robots.observations
    for part in range(p.parts):
        for age in range(p.part_frames[part] - 1, 0, -1):
            for k in range(p.part_sizes[part]):
                out[i, p.part_starts[part, age] + k] = out[i, p.part_starts[part, age - 1] + k]


@kernel(fastmath=FAST, inline="always")
def observe(i, robots, geometry, p):
    """Write what robot i sees now before what it saw earlier; `sim.observations` says what each number is."""
    if p.frames > 1:
        _grow_older(i, robots, p)
    record = robots.records[i]
    out = robots.observations
    if p.part_places[RANGES_PART] >= 0:
        _see_ranges(i, robots, p)
    if p.part_places[SPEEDS_PART] >= 0:
        at = p.part_places[SPEEDS_PART]
        out[i, at] = record.linear
        if p.drive == OMNIDIRECTIONAL:
            at += 1
            out[i, at] = record.lateral
        out[i, at + 1] = record.angular
    if p.part_places[ACTIONS_PART] >= 0:
        for k in range(robots.commands.shape[1]):
            out[i, p.part_places[ACTIONS_PART] + k] = robots.commands[i, k]
    heading = robots.poses[i, 2]
    dx = robots.targets[i, 0] - robots.poses[i, 0]
    dy = robots.targets[i, 1] - robots.poses[i, 1]
    distance = record.distance
    if p.drifts:
        dx -= np.float32(robots.drift[i, 0])
        dy -= np.float32(robots.drift[i, 1])
        distance = np.float32(math.sqrt(dx * dx + dy * dy))
        heading = wrapped(heading + np.float32(robots.drift[i, 2]))
    bearing = bearing_of(dx, dy, heading)
    if p.part_places[DISTANCE_PART] >= 0:
        if p.part_options[DISTANCE_PART]:
            out[i, p.part_places[DISTANCE_PART]] = distance / (distance + ONE)
        else:
            width = geometry.bounds[record.map, 0]
            height = geometry.bounds[record.map, 1]
            diagonal = np.float32(2.0) * np.float32(math.sqrt(width * width + height * height))
            out[i, p.part_places[DISTANCE_PART]] = min(distance / diagonal, ONE) if p.drifts else distance / diagonal
    if p.part_places[DIRECTION_PART] >= 0:
        direction = np.float32(math.atan2(dy, dx))
        out[i, p.part_places[DIRECTION_PART]] = (direction if direction >= ZERO else direction + TWO_PI) / TWO_PI
    if p.part_places[BEARING_PART] >= 0:
        if p.part_options[BEARING_PART]:
            out[i, p.part_places[BEARING_PART]] = np.float32(math.sin(bearing))
            out[i, p.part_places[BEARING_PART] + 1] = np.float32(math.cos(bearing))
        else:
            out[i, p.part_places[BEARING_PART]] = bearing / PI
    if p.part_places[HEADING_PART] >= 0:
        if p.part_options[HEADING_PART]:
            out[i, p.part_places[HEADING_PART]] = heading / PI
        else:
            out[i, p.part_places[HEADING_PART]] = (heading if heading >= ZERO else heading + TWO_PI) / TWO_PI
    if p.part_places[DEVIATION_PART] >= 0:
        out[i, p.part_places[DEVIATION_PART]] = abs(bearing) / PI


@kernel(fastmath=FAST)
def observe_ways(i, robots, geometry, p):
    """Write what robot i sees of its trail and of ways ahead; apart from `observe`, which it would slow for all others."""
    x = robots.poses[i, 0]
    y = robots.poses[i, 1]
    heading = robots.poses[i, 2]
    if p.drifts:
        x += np.float32(robots.drift[i, 0])
        y += np.float32(robots.drift[i, 1])
        heading = wrapped(heading + np.float32(robots.drift[i, 2]))
    dx = robots.targets[i, 0] - x
    dy = robots.targets[i, 1] - y
    if p.part_places[REACH_PART] >= 0:
        see_reach(i, dx, dy, heading, robots, geometry, p)
    if p.part_places[TRAIL_PART] >= 0:
        see_trail(i, x, y, heading, robots, geometry, p)
    if p.part_places[DWELL_PART] >= 0:
        see_dwell(i, x, y, robots, p)
    sees_openings = p.part_places[OPENINGS_PART] >= 0
    is_kept = False
    if p.part_places[KNOWN_PART] >= 0 or sees_openings:
        is_kept = keep_view(i, x, y, heading, robots, geometry, p)
    if sees_openings:
        see_openings(i, x, y, dx, dy, heading, is_kept, robots, geometry, p)
    if p.part_places[KNOWN_PART] >= 0:
        see_known(i, x, y, dx, dy, heading, robots, geometry, p)
    if p.part_places[WAY_PART] >= 0:
        see_way(i, bearing_of(dx, dy, heading), np.float32(math.sqrt(dx * dx + dy * dy)), robots, geometry, p)


@kernel(fastmath=FAST, inline="always")
def repeat_first(i, robots, p):
    """Let what robot i sees first in an episode stand for what it saw earlier too."""
    for part in range(p.parts):
        for age in range(1, p.part_frames[part]):
            for k in range(p.part_sizes[part]):
                robots.observations[i, p.part_starts[part, age] + k] = robots.observations[i, p.part_starts[part, 0] + k]
