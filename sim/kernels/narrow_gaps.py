"""Gaps that a robot measured from near by and does not fit through: no way and no sight leads through them from then on.

From afar a gap looks wider than it is, since the rays beside it meet its posts somewhere behind their edge. So what was
measured from near by is remembered as a line that closes the gap, and a later view from afar does not open it again.
"""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.room import GAP_ROOM, LINK_ROOM, OPENING_ROOM, THROUGH_GAP, VIEW_ROOM
from sim.kernels.sensing import FAST
from sim.kernels.views import FULL_RANGE, NO_SIGHT, SIGHT_THROUGH_GAP, VIEW_COS, VIEW_DIRECTIONS, VIEW_SIN
from sim.kernels.walls import JUMP

NEAR_BY = 1.6
"""Metres from a view up to which both posts of a gap that it measures lie."""

ROOM_TO_PASS = 1.125
"""Width of the narrowest gap that a robot is led through, in widths of the body with the distance that it keeps."""

POST = 0.1
"""Metres by which the line that closes a gap goes on into its posts."""

SAME_GAP = 0.2
"""Metres within which the ends of two such lines lie, if they close the same gap."""

_FULL = np.float32(FULL_RANGE)
_JUMP = np.float32(JUMP)
_NEAR_BY = np.float32(NEAR_BY)
_WIDTH = np.float32(2.0 * ROOM_TO_PASS)
_POST = np.float32(POST)
_SAME_SQUARED = np.float32(SAME_GAP * SAME_GAP)
# A ray meets a post up to one direction's arc behind its edge, and half of that on average.
_BEHIND_EDGE = np.float32(math.pi / VIEW_DIRECTIONS)
_BESIDE = VIEW_DIRECTIONS // 4
_TINY = np.float32(1e-6)


@kernel(fastmath=FAST)
def _crosses(from_x, from_y, to_x, to_y, gap):
    """Whether the line from one place to another crosses the one that closes a gap."""
    along_x = to_x - from_x
    along_y = to_y - from_y
    one = along_x * (gap[1] - from_y) - along_y * (gap[0] - from_x)
    other = along_x * (gap[3] - from_y) - along_y * (gap[2] - from_x)
    if (one > 0) == (other > 0):
        return False
    across_x = gap[2] - gap[0]
    across_y = gap[3] - gap[1]
    one = across_x * (from_y - gap[1]) - across_y * (from_x - gap[0])
    other = across_x * (to_y - gap[1]) - across_y * (to_x - gap[0])
    return (one > 0) != (other > 0)


@kernel(fastmath=FAST)
def leads_through_gap(i, from_x, from_y, to_x, to_y, robots):
    """Whether the line from one place to another goes through a gap that the body does not fit through."""
    leads_through = False
    for k in range(min(robots.gaps_found[i], GAP_ROOM)):
        leads_through |= _crosses(from_x, from_y, to_x, to_y, robots.gaps[i, k])
    return leads_through


@kernel(fastmath=FAST)
def _is_known(i, x, y, other_x, other_y, robots):
    """Whether the gap between two ends is remembered, whichever of them is named first."""
    for k in range(min(robots.gaps_found[i], GAP_ROOM)):
        gap = robots.gaps[i, k]
        for turned in range(2):
            dx = gap[2 * turned] - x
            dy = gap[2 * turned + 1] - y
            other_dx = gap[2 - 2 * turned] - other_x
            other_dy = gap[3 - 2 * turned] - other_y
            if dx * dx + dy * dy < _SAME_SQUARED and other_dx * other_dx + other_dy * other_dy < _SAME_SQUARED:
                return True
    return False


@kernel(fastmath=FAST)
def _close(i, gap, number, first, target_x, target_y, robots):
    """Let nothing that was free lead through a gap any more: no opening, no sight of the target, no link."""
    for k in range(OPENING_ROOM):
        view = robots.opening_views[i, k]
        if view >= first:
            here = robots.view_places[i, view % VIEW_ROOM]
            place = robots.opening_places[i, k]
            if _crosses(here[0], here[1], place[0], place[1], gap):
                robots.opening_access[i, k] = THROUGH_GAP
    for view in range(first, number):
        row = view % VIEW_ROOM
        x = robots.view_places[i, row, 0]
        y = robots.view_places[i, row, 1]
        if robots.view_sights[i, row] != NO_SIGHT and _crosses(x, y, target_x, target_y, gap):
            robots.view_sights[i, row] = SIGHT_THROUGH_GAP
        links = robots.view_links[i, row]
        # The first one is the way that it came.
        kept = 1
        for k in range(1, LINK_ROOM):
            if links[k] < 0:
                break
            there = robots.view_places[i, links[k] % VIEW_ROOM]
            if not _crosses(x, y, there[0], there[1], gap):
                links[kept] = links[k]
                kept += 1
        links[kept:] = -1


@kernel(fastmath=FAST)
def _measure_gap(i, near, beyond, step, number, first, target_x, target_y, robots, p):
    """Close the gap beside where a reading of the newest view ends, if the body does not fit through it.

    Args:
        i: the robot.
        near: the reading's direction.
        beyond: the first direction on the other side.
        step: 1 or -1, towards that.
        number: of the newest view.
        first: of the oldest one that is remembered.
        target_x: metres.
        target_y: likewise.
        robots: `sim.kernels.bundles.Robots`.
        p: a row of PARAMETERS.
    """
    row = number % VIEW_ROOM
    scale = p.range / _FULL
    reading = np.float32(robots.views[i, row, near]) * scale
    if reading > _NEAR_BY:
        return
    x = reading * VIEW_COS[near]
    y = reading * VIEW_SIN[near]
    least = _WIDTH * p.near
    across_x = np.float32(0.0)
    across_y = np.float32(0.0)
    length = np.float32(0.0)
    for k in range(_BESIDE):
        j = (beyond + step * k) % VIEW_DIRECTIONS
        other = np.float32(robots.views[i, row, j]) * scale
        # Where no ray pointed a view reads 0.
        if other <= 0 or other > _NEAR_BY:
            continue
        dx = other * VIEW_COS[j] - x
        dy = other * VIEW_SIN[j] - y
        apart = np.float32(math.sqrt(dx * dx + dy * dy))
        width = apart - _BEHIND_EDGE * (reading + other)
        if width < least:
            least = width
            across_x = dx
            across_y = dy
            # Between two readings side by side no ray went through: a wall seen at a flat angle looks like this.
            length = apart if k > 0 else np.float32(0.0)
    if length <= _TINY:
        return
    into = _POST / length
    here = robots.view_places[i, row]
    one_x = here[0] + x - into * across_x
    one_y = here[1] + y - into * across_y
    other_x = here[0] + x + (np.float32(1.0) + into) * across_x
    other_y = here[1] + y + (np.float32(1.0) + into) * across_y
    if not _is_known(i, one_x, one_y, other_x, other_y, robots):
        gap = robots.gaps[i, robots.gaps_found[i] % GAP_ROOM]
        gap[0] = one_x
        gap[1] = one_y
        gap[2] = other_x
        gap[3] = other_y
        robots.gaps_found[i] += 1
        _close(i, gap, number, first, target_x, target_y, robots)


@kernel(fastmath=FAST)
def close_gaps(i, number, first, target_x, target_y, robots, p):
    """Remember the gaps that the newest view measures and that the body does not fit through."""
    row = number % VIEW_ROOM
    if number == 0:
        robots.gaps_found[i] = 0
    scale = p.range / _FULL
    for k in range(VIEW_DIRECTIONS):
        following = (k + 1) % VIEW_DIRECTIONS
        right = np.float32(robots.views[i, row, k]) * scale
        left = np.float32(robots.views[i, row, following]) * scale
        if min(right, left) <= 0 or abs(right - left) <= _JUMP:
            continue
        if right < left:
            _measure_gap(i, k, following, 1, number, first, target_x, target_y, robots, p)
        else:
            _measure_gap(i, following, k, -1, number, first, target_x, target_y, robots, p)
