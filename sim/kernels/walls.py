"""Walls that a robot's views show, and how many of them lie between one place and another.

Beyond an opening all counts as free, but a straight line from there to the target may cross a wall that was seen. The
planners that let A* go through what was never seen know such walls from their grid; here the views tell.
"""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.room import VIEW_ROOM
from sim.kernels.sensing import FAST
from sim.kernels.views import FULL_RANGE, VIEW_COS, VIEW_DIRECTIONS, VIEW_SIN

JUMP = 0.4
"""Metres by which two readings side by side differ where what they met is not one thing."""

CHORD_DIRECTIONS = 5
"""Directions of a view that one chord spans."""

CHORDS = VIEW_DIRECTIONS // CHORD_DIRECTIONS
"""Chords of a view, all around."""

WALL_SPACING = 0.5
"""Metres of a line of which it is remembered whether a wall crosses it."""

WALL_BITS = 60
"""Pieces of a line of which that is remembered; the last one is all beyond."""

MARGIN = 0.2
"""Metres from the ends of a line within which a wall is none that lies between."""

_FULL = np.float32(FULL_RANGE)
_JUMP = np.float32(JUMP)
_SPACING = np.float32(WALL_SPACING)
_MARGIN = np.float32(MARGIN)
_LAST = np.float32(WALL_BITS - 1)
_ALL = (1 << CHORDS) - 1


@kernel(fastmath=FAST)
def find_walls(i, row, robots, p):
    """Write which chords of a view are walls: where all readings met something, without a jump, and beside them likewise."""
    most = _JUMP * _FULL / p.range
    solid = 0
    for chord in range(CHORDS):
        is_solid = True
        for k in range(chord * CHORD_DIRECTIONS, (chord + 1) * CHORD_DIRECTIONS):
            one = np.float32(robots.views[i, row, k])
            other = np.float32(robots.views[i, row, (k + 1) % VIEW_DIRECTIONS])
            if min(one, other) == 0 or max(one, other) == _FULL or abs(one - other) > most:
                is_solid = False
        solid |= is_solid << chord
    before = (solid << 1 | solid >> (CHORDS - 1)) & _ALL
    behind = (solid >> 1 | solid << (CHORDS - 1)) & _ALL
    robots.view_walls[i, row] = solid & before & behind


@kernel(fastmath=FAST)
def walls_across(i, row, x, y, to_x, to_y, robots, p):
    """Where walls of a view cross the line from one place to another: bit b for its piece b * WALL_SPACING metres on."""
    walls = robots.view_walls[i, row]
    length = np.float32(math.sqrt((to_x - x) * (to_x - x) + (to_y - y) * (to_y - y)))
    crossed = 0
    if walls == 0 or length <= 2.0 * _MARGIN:
        return crossed
    cos = (to_x - x) / length
    sin = (to_y - y) / length
    from_x = robots.view_places[i, row, 0] - x
    from_y = robots.view_places[i, row, 1] - y
    scale = p.range / _FULL
    for chord in range(CHORDS):
        if walls >> chord & 1 == 0:
            continue
        k = chord * CHORD_DIRECTIONS
        reading = np.float32(robots.views[i, row, k]) * scale
        one_x = from_x + reading * VIEW_COS[k]
        one_y = from_y + reading * VIEW_SIN[k]
        k = (k + CHORD_DIRECTIONS) % VIEW_DIRECTIONS
        reading = np.float32(robots.views[i, row, k]) * scale
        other_x = from_x + reading * VIEW_COS[k]
        other_y = from_y + reading * VIEW_SIN[k]
        one_across = one_y * cos - one_x * sin
        other_across = other_y * cos - other_x * sin
        if (one_across > 0) == (other_across > 0):
            continue
        one_along = one_x * cos + one_y * sin
        other_along = other_x * cos + other_y * sin
        along = (one_across * other_along - other_across * one_along) / (one_across - other_across)
        if along > _MARGIN and along < length - _MARGIN:
            crossed |= 1 << int(min(along / _SPACING, _LAST))
    return crossed


@kernel(fastmath=FAST)
def walls_seen_across(i, x, y, to_x, to_y, number, first, robots, p):
    """`walls_across` of all views that are remembered."""
    crossed = 0
    for view in range(first, number + 1):
        crossed |= walls_across(i, view % VIEW_ROOM, x, y, to_x, to_y, robots, p)
    return crossed


@kernel(fastmath=FAST)
def count_walls(crossed):
    """How many walls these are: pieces side by side are of one."""
    begins = crossed & ~(crossed << 1)
    count = 0
    while begins:
        begins &= begins - 1
        count += 1
    return count
