"""How far a robot could go straight on in each direction, as its scan shows.

A scan shows where things are, not between which of them a body has room. Where the body is taken for a point and things for
as much larger (Lozano-Perez 1983, "Spatial Planning: A Configuration Space Approach"), gaps that it fits through are seen at
once.
"""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.records import REACH_PART
from sim.kernels.room import REACH_DIRECTIONS
from sim.kernels.sensing import FAST

TOGETHER = 32
"""Directions that are worked out at once: what a compiler makes one turn of a loop of."""

ZERO = np.float32(0.0)
HALF = np.float32(0.5)
PI = np.float32(math.pi)
QUARTER = np.float32(0.5 * math.pi)
TWO_PI = np.float32(2.0 * math.pi)
# The arc sine of r is at most r + _ABOVE r^3, and no more at 1.
_ABOVE = np.float32(0.5 * math.pi - 1.0)


@kernel(fastmath=FAST)
def _shorten(reach, cos, sin, count, near, x, y, distance, towards):
    """Let a robot go no further in any direction than until it is near a reading's end, x and y in its own frame."""
    squared = near * near
    # Directions that pass it at less than `near`, and some more: of what is nearer than that, half of all.
    half = QUARTER
    if distance > near:
        ratio = near / distance
        half = ratio + _ABOVE * ratio * ratio * ratio
    per_radian = np.float32(count) / TWO_PI
    first = np.int64(math.ceil((towards + PI - half) * per_radian - HALF))
    last = np.int64(math.floor((towards + PI + half) * per_radian - HALF))
    begin = first if first >= 0 else first + count
    end = begin + (last - first + TOGETHER) // TOGETHER * TOGETHER
    cos = cos[begin:end]
    sin = sin[begin:end]
    reach = reach[begin:end]
    for k in range(end - begin):
        along = x * cos[k] + y * sin[k]
        across = y * cos[k] - x * sin[k]
        inside = squared - across * across
        free = max(along - np.float32(math.sqrt(max(inside, ZERO))), ZERO)
        meets = inside > ZERO and along > ZERO
        reach[k] = min(reach[k], free if meets else reach[k])


@kernel(fastmath=FAST)
def see_reach(i, to_x, to_y, heading, robots, geometry, p):
    """Write how far robot i could go, d / (d + reach).

    If it is told, also how much nearer to its target that may bring it. Sector by sector from right to left, beginning
    behind it.

    Args:
        i: the robot.
        to_x: metres from where it believes to be to its target.
        to_y: likewise.
        heading: likewise, radians.
        robots: `sim.kernels.bundles.Robots`; `reach` and `observations` are written.
        geometry: `sim.kernels.bundles.Geometry`.
        p: a row of PARAMETERS; `near` is d, the distance on all sides that must stay free.
    """
    reach = robots.reach[i]
    cos = geometry.reach_cos
    sin = geometry.reach_sin
    count = p.reach_sectors * REACH_DIRECTIONS
    for k in range(reach.shape[0]):
        reach[k] = p.range
    rays = geometry.ray_angles.shape[0]
    for ray in range(p.lidars * rays):
        reading = robots.ranges[i, ray]
        if reading < p.range:
            x = np.float32(p.mounts[ray // rays, 0]) + reading * geometry.scan_cos[ray]
            y = np.float32(p.mounts[ray // rays, 1]) + reading * geometry.scan_sin[ray]
            distance = reading
            towards = np.float32(geometry.ray_angles[ray % rays])
            if p.mounted:
                distance = np.float32(math.sqrt(x * x + y * y))
                towards = np.float32(math.atan2(y, x))
            _shorten(reach, cos, sin, count, p.near, x, y, distance, towards)
    for turn in range(count, reach.shape[0], count):
        for k in range(min(count, reach.shape[0] - turn)):
            reach[k] = min(reach[k], reach[turn + k])
    out = robots.observations
    at = p.part_places[REACH_PART]
    for sector in range(p.reach_sectors):
        farthest = ZERO
        for k in range(sector * REACH_DIRECTIONS, (sector + 1) * REACH_DIRECTIONS):
            farthest = max(farthest, reach[k])
        out[i, at + sector] = p.near / (p.near + farthest)
    if not p.part_options[REACH_PART]:
        return
    at += p.reach_sectors
    turn_cos = np.float32(math.cos(heading))
    turn_sin = np.float32(math.sin(heading))
    x = to_x * turn_cos + to_y * turn_sin
    y = to_y * turn_cos - to_x * turn_sin
    left = np.float32(math.sqrt(x * x + y * y))
    for sector in range(p.reach_sectors):
        least = left + p.range
        for k in range(sector * REACH_DIRECTIONS, (sector + 1) * REACH_DIRECTIONS):
            beside_x = x - reach[k] * cos[k]
            beside_y = y - reach[k] * sin[k]
            least = min(least, np.float32(math.sqrt(beside_x * beside_x + beside_y * beside_y)))
        out[i, at + sector] = (left - least) / p.range
