"""Where a robot has been in its attempt: crumbs that it drops on its way, and which of them are in sight.

A robot without a map that sees them can tell a door that it came through from one that it has not tried, as ants do
(Svennebring and Koenig 2004, "Building Terrain-Covering Ant Robots").
"""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.records import TRAIL_PART
from sim.kernels.room import LONG_TRAIL_ROOM
from sim.kernels.sensing import FAST

TRAIL_SPACING = 0.24
"""Metres from the last crumb at which the next one is dropped; no multiple of what a robot usually drives in a step."""

SEEN_BEHIND = 0.1
"""Metres by which a crumb may lie behind what its ray meets and count as in sight; nearer ones than this lie underfoot."""

ZERO = np.float32(0.0)
ONE = np.float32(1.0)
PI = np.float32(math.pi)
TWO_PI = np.float32(2.0 * math.pi)
_SPACING = np.float32(TRAIL_SPACING)
_BEHIND = np.float32(SEEN_BEHIND)
_SEVERAL = np.float32(5.0)
_LATELY = np.float32(10.0)
# Crumbs of which a trail that is told to be half its length has so many, by its memory.
_HALF_WAY = (np.float32(40.0), np.float32(160.0))


@kernel(fastmath=FAST)
def _drop(i, x, y, robots):
    """Let robot i drop a crumb where the last one is far enough; returns how many it has dropped."""
    trail = robots.trail
    room = trail.shape[1]
    dropped = robots.crumbs[i]
    if dropped > 0:
        last = (dropped - 1) % room
        dx = x - trail[i, last, 0]
        dy = y - trail[i, last, 1]
        if dx * dx + dy * dy < _SPACING * _SPACING:
            return dropped
    trail[i, dropped % room, 0] = x
    trail[i, dropped % room, 1] = y
    robots.crumbs[i] = dropped + 1
    return dropped + 1


@kernel(fastmath=FAST)
def _ray_towards(angle, angles, yaw):
    """The ray of the first LiDAR that points nearest to an angle against the heading; -1 where none does."""
    rays = angles.shape[0]
    turned = angle - yaw
    if turned < angles[0] - math.pi / rays:
        turned += 2.0 * math.pi
    step = angles[1] - angles[0]
    ray = np.int64(math.floor((turned - angles[0]) / step + 0.5))
    if ray == rays and step * rays > 2.0 * math.pi - 1e-6:
        return 0
    return ray if 0 <= ray < rays else -1


@kernel(fastmath=FAST)
def _freshness(age, is_long):
    """How fresh a crumb is after so many others, 1 to 0; by logarithms, two that are old can be told apart, too."""
    if is_long:
        return ONE - np.float32(math.log(ONE + age)) / np.float32(math.log(1.0 + LONG_TRAIL_ROOM))
    return _LATELY / (_LATELY + age)


@kernel(fastmath=FAST)
def see_trail(i, x, y, heading, robots, geometry, p):
    """Drop a crumb and write what robot i sees of its trail, sector by sector from right to left, beginning behind it.

    Args:
        i: the robot.
        x: metres, where it believes to be.
        y: likewise.
        heading: likewise, radians.
        robots: `sim.kernels.bundles.Robots`; `trail`, `crumbs` and `observations` are written.
        geometry: `sim.kernels.bundles.Geometry`.
        p: a row of PARAMETERS.
    """
    dropped = _drop(i, x, y, robots)
    trail = robots.trail
    room = trail.shape[1]
    is_long = p.part_options[TRAIL_PART]
    out = robots.observations
    sectors = p.trail_sectors
    nearness = p.part_places[TRAIL_PART]
    count = nearness + sectors
    freshness = count + sectors
    first = freshness + sectors
    length = first + sectors if is_long else first
    for k in range(nearness, length):
        out[i, k] = ZERO
    out[i, length] = np.float32(dropped) / (np.float32(dropped) + _HALF_WAY[is_long])
    cos = np.float32(math.cos(heading))
    sin = np.float32(math.sin(heading))
    # The oldest first, so that the newest of a sector is the last to say how fresh it is.
    for number in range(max(0, dropped - room), dropped):
        dx = trail[i, number % room, 0] - x
        dy = trail[i, number % room, 1] - y
        squared = dx * dx + dy * dy
        if squared < _BEHIND * _BEHIND or squared >= p.range * p.range:
            continue
        distance = np.float32(math.sqrt(squared))
        angle = np.float32(math.atan2(cos * dy - sin * dx, cos * dx + sin * dy))
        ray = _ray_towards(angle, geometry.ray_angles, p.mounts[0, 2])
        if ray >= 0 and robots.ranges[i, ray] < distance - _BEHIND:
            continue
        k = min(np.int64((angle + PI) / TWO_PI * np.float32(sectors)), sectors - 1)
        out[i, nearness + k] = max(out[i, nearness + k], ONE - distance / p.range)
        out[i, count + k] += ONE
        out[i, freshness + k] = _freshness(np.float32(dropped - 1 - number), is_long)
        if is_long and out[i, first + k] == ZERO:
            out[i, first + k] = out[i, freshness + k]
    for k in range(count, freshness):
        out[i, k] = out[i, k] / (out[i, k] + _SEVERAL)
