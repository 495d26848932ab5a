"""Views that a robot keeps on its way: what its LiDAR read all around, and where; and what they show."""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.room import VIEW_ROOM
from sim.kernels.sensing import FAST

VIEW_SPACING = 0.48
"""Metres from the last view at which the next one is kept."""

VIEW_DIRECTIONS = 120
"""Readings of a view, all around from the direction in which the robot believes -pi to be."""

FULL_RANGE = 255
"""What a view's reading of the LiDAR's range is kept as: in a byte, shorter ones in proportion."""

SLIM = 0.95
"""Of the distance that a robot keeps from obstacles, what a view has to show to be free on both sides of a way."""

NO_SIGHT, SIGHT, FREE_SIGHT, SIGHT_THROUGH_GAP = 0, 1, 2, 3
"""Of a place: whether a view shows it, and whether the body can go there straight on; see `sim.kernels.narrow_gaps`."""

ZERO = np.float32(0.0)
PI = np.float32(math.pi)
_SPACING = np.float32(VIEW_SPACING)
_HALF = np.float32(0.5)
_FULL = np.float32(FULL_RANGE)
_SLIM = np.float32(SLIM)
_PER_RADIAN = np.float32(VIEW_DIRECTIONS / (2.0 * math.pi))
_MIDDLES = (np.arange(VIEW_DIRECTIONS) + 0.5) * (2.0 * math.pi / VIEW_DIRECTIONS) - math.pi
VIEW_COS, VIEW_SIN = np.cos(_MIDDLES).astype(np.float32), np.sin(_MIDDLES).astype(np.float32)


@kernel(fastmath=FAST)
def keep_view(i, x, y, heading, robots, geometry, p):
    """Let robot i keep its view where the last one was kept far enough away; returns whether it did."""
    places = robots.view_places
    kept = robots.views_kept[i]
    if kept > 0:
        last = (kept - 1) % VIEW_ROOM
        dx = x - places[i, last, 0]
        dy = y - places[i, last, 1]
        if dx * dx + dy * dy < _SPACING * _SPACING:
            return False
    row = kept % VIEW_ROOM
    places[i, row, 0] = x
    places[i, row, 1] = y
    angles = geometry.ray_angles
    rays = angles.shape[0]
    step = angles[1] - angles[0]
    all_round = step * rays > 2.0 * math.pi - 1e-6
    for k in range(VIEW_DIRECTIONS):
        direction = ((k + 0.5) / VIEW_DIRECTIONS - 0.5) * 2.0 * math.pi
        # Against the first ray, in one turn that begins half a step before it.
        turned = direction - heading - p.mounts[0, 2] - angles[0]
        turned -= 2.0 * math.pi * math.floor((turned + 0.5 * step) / (2.0 * math.pi))
        ray = np.int64(math.floor(turned / step + 0.5))
        if all_round:
            ray = ray % rays
        reading = robots.ranges[i, ray] if ray < rays else ZERO
        robots.views[i, row, k] = np.uint8(math.floor(reading / p.range * _FULL + _HALF))
    robots.views_kept[i] = kept + 1
    return True


@kernel(fastmath=FAST)
def shows(i, row, x, y, slack, robots, p):
    """Whether a view shows a place: neither of the two readings beside it ends more than the slack before it."""
    dx = x - robots.view_places[i, row, 0]
    dy = y - robots.view_places[i, row, 1]
    squared = dx * dx + dy * dy
    farthest = p.range + slack
    if squared > farthest * farthest:
        return False
    place = (np.float32(math.atan2(dy, dx)) + PI) * _PER_RADIAN - _HALF
    k = np.int64(math.floor(place))
    nearer = min(robots.views[i, row, k % VIEW_DIRECTIONS], robots.views[i, row, (k + 1) % VIEW_DIRECTIONS])
    sight = np.float32(nearer) * p.range / _FULL + slack
    return squared <= sight * sight


@kernel(fastmath=FAST)
def is_free_way(i, row, cos, sin, until, robots, p):
    """Whether the body can go straight on from a view in a direction, for so many metres, as its readings show."""
    scale = p.range / _FULL
    width = _SLIM * p.near
    met = 0
    for k in range(VIEW_DIRECTIONS):
        reading = np.float32(robots.views[i, row, k])
        x = reading * scale * VIEW_COS[k]
        y = reading * scale * VIEW_SIN[k]
        along = x * cos + y * sin
        across = abs(y * cos - x * sin)
        met += (reading < _FULL) & (along > ZERO) & (along < until) & (across < width)
    return met == 0


@kernel(fastmath=FAST)
def sight_of(i, row, x, y, robots, p):
    """NO_SIGHT, SIGHT or FREE_SIGHT of a place."""
    if not shows(i, row, x, y, ZERO, robots, p):
        return NO_SIGHT
    dx = x - robots.view_places[i, row, 0]
    dy = y - robots.view_places[i, row, 1]
    distance = np.float32(math.sqrt(dx * dx + dy * dy))
    if distance < _SLIM * p.near or is_free_way(i, row, dx / distance, dy / distance, distance, robots, p):
        return FREE_SIGHT
    return SIGHT
