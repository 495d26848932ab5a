"""Openings among what a robot has seen: edges of its views behind which no view shows anything.

What a view shows only through a gap that the body does not fit through (`sim.kernels.narrow_gaps`) was not seen yet: another
way may lead there. On the way to an opening the body goes through its gate, half way between the edge and what stands
across, since an opening itself lies behind the edge that hides it.
"""

import math

import numpy as np

from sim.kernels.narrow_gaps import leads_through_gap
from sim.kernels.options import kernel
from sim.kernels.patience import forgive
from sim.kernels.room import OPENING_ROOM, ROUND_A_BEND, STRAIGHT_ON, THROUGH_GAP, VIEW_ROOM
from sim.kernels.sensing import FAST
from sim.kernels.views import FULL_RANGE, SLIM, VIEW_COS, VIEW_DIRECTIONS, VIEW_SIN, is_free_way, shows
from sim.kernels.walls import JUMP, find_walls, walls_across, walls_seen_across

SLACK = 0.2
"""Metres by which a view may fall short of an opening that it shows: a wall that is seen at a flat angle has none."""

SAME_OPENING = 0.4
"""Metres within which two openings are one."""

FLAT_RUN = 10
"""Directions that all read the LiDAR's range and have one opening."""

GATE_WIDTH = 3.0
"""Widest gap in the middle of which a gate lies, in distances that the robot keeps from obstacles; where nothing stands
across within that, a gate lies half of it beside the edge."""

_HALF = np.float32(0.5)
_FULL = np.float32(FULL_RANGE)
_JUMP = np.float32(JUMP)
_SLACK = np.float32(SLACK)
_SAME_SQUARED = np.float32(SAME_OPENING * SAME_OPENING)
_WIDTH = np.float32(2.0 * SLIM)
_GATE_WIDTH = np.float32(GATE_WIDTH)
_EDGES = (np.arange(VIEW_DIRECTIONS) + 1.0) * (2.0 * math.pi / VIEW_DIRECTIONS) - math.pi
_EDGE_COS, _EDGE_SIN = np.cos(_EDGES).astype(np.float32), np.sin(_EDGES).astype(np.float32)
# Of a full turn, on each side of an opening, where what narrows it may stand.
_BESIDE = VIEW_DIRECTIONS // 4


@kernel(fastmath=FAST)
def _find_gate(i, row, near, beyond, step, cos, sin, robots, p):
    """Where the body goes through beside where a reading ends, and whether it fits.

    Args:
        i: the robot.
        row: of the view.
        near: the reading's direction.
        beyond: the first direction on the other side.
        step: 1 or -1, towards that.
        cos: of the edge's direction, between both.
        sin: likewise.
        robots: `sim.kernels.bundles.Robots`.
        p: a row of PARAMETERS.

    Returns:
        (x, y, fits): metres from the view, and whether the gap there is wide enough.
    """
    scale = p.range / _FULL
    reading = np.float32(robots.views[i, row, near]) * scale
    x = reading * VIEW_COS[near]
    y = reading * VIEW_SIN[near]
    width = _WIDTH * p.near
    widest = _GATE_WIDTH * p.near
    least = widest * widest
    across_x = -step * widest * sin
    across_y = step * widest * cos
    for k in range(_BESIDE):
        j = (beyond + step * k) % VIEW_DIRECTIONS
        other = np.float32(robots.views[i, row, j])
        # Where no ray pointed a view reads 0, where none met anything its range.
        if other == 0 or other == _FULL:
            continue
        other *= scale
        dx = other * VIEW_COS[j] - x
        dy = other * VIEW_SIN[j] - y
        squared = dx * dx + dy * dy
        if squared < least:
            least = squared
            across_x = dx
            across_y = dy
    return x + _HALF * across_x, y + _HALF * across_y, least >= width * width


@kernel(fastmath=FAST)
def _has_seen(i, row, x, y, robots, p):
    """Whether a view shows a place, and not only through a gap that the body does not fit through."""
    if not shows(i, row, x, y, _SLACK, robots, p):
        return False
    here = robots.view_places[i, row]
    return not leads_through_gap(i, here[0], here[1], x, y, robots)


@kernel(fastmath=FAST)
def _open(i, x, y, gate_x, gate_y, is_free, number, first, target_x, target_y, robots, p):
    """Remember an opening of the newest view, unless an earlier one shows it."""
    for other in range(first, number):
        if _has_seen(i, other % VIEW_ROOM, x, y, robots, p):
            return
    here = robots.view_places[i, number % VIEW_ROOM]
    way = STRAIGHT_ON if is_free else ROUND_A_BEND
    if leads_through_gap(i, here[0], here[1], x, y, robots):
        way = THROUGH_GAP
    places = robots.opening_places
    seen_from = robots.opening_views
    # In place of the same one, or of the one that was seen the longest ago.
    place = 0
    is_new = True
    for k in range(OPENING_ROOM):
        if seen_from[i, k] >= 0:
            dx = places[i, k, 0] - x
            dy = places[i, k, 1] - y
            if dx * dx + dy * dy < _SAME_SQUARED:
                if robots.opening_access[i, k] > way:
                    return
                place = k
                is_new = False
                break
        if seen_from[i, k] < seen_from[i, place]:
            place = k
    places[i, place, 0] = x
    places[i, place, 1] = y
    robots.opening_gates[i, place, 0] = gate_x
    robots.opening_gates[i, place, 1] = gate_y
    if is_new:
        forgive(i, place, robots)
    robots.opening_walls[i, place] = walls_seen_across(i, x, y, target_x, target_y, number, first, robots, p)
    seen_from[i, place] = number
    robots.opening_access[i, place] = way


@kernel(fastmath=FAST)
def look_for_openings(i, number, first, target_x, target_y, robots, p):
    """Close the openings that the newest view shows, open those that it has; see what walls it has before the target."""
    row = number % VIEW_ROOM
    find_walls(i, row, robots, p)
    seen_from = robots.opening_views
    for k in range(OPENING_ROOM):
        if number == first:
            seen_from[i, k] = -1
        elif seen_from[i, k] >= 0:
            x = robots.opening_places[i, k, 0]
            y = robots.opening_places[i, k, 1]
            if seen_from[i, k] < first or _has_seen(i, row, x, y, robots, p):
                seen_from[i, k] = -1
            else:
                robots.opening_walls[i, k] |= walls_across(i, row, x, y, target_x, target_y, robots, p)
    here_x = robots.view_places[i, row, 0]
    here_y = robots.view_places[i, row, 1]
    scale = p.range / _FULL
    run = 0
    for k in range(VIEW_DIRECTIONS):
        following = (k + 1) % VIEW_DIRECTIONS
        a = robots.views[i, row, k]
        b = robots.views[i, row, following]
        if a == 0 or b == 0:
            run = 0
            continue
        right = np.float32(a) * scale
        left = np.float32(b) * scale
        if abs(right - left) > _JUMP:
            if right < left:
                gate_x, gate_y, fits = _find_gate(i, row, k, following, 1, _EDGE_COS[k], _EDGE_SIN[k], robots, p)
            else:
                gate_x, gate_y, fits = _find_gate(i, row, following, k, -1, _EDGE_COS[k], _EDGE_SIN[k], robots, p)
            if fits:
                nearer = min(right, left)
                is_free = is_free_way(i, row, _EDGE_COS[k], _EDGE_SIN[k], nearer - p.near, robots, p)
                away = (right + left) * _HALF
                x = here_x + away * _EDGE_COS[k]
                y = here_y + away * _EDGE_SIN[k]
                gate_x += here_x
                gate_y += here_y
                _open(i, x, y, gate_x, gate_y, is_free, number, first, target_x, target_y, robots, p)
        run = run + 1 if a == FULL_RANGE else 0
        if run > 0 and (run == FLAT_RUN or b != FULL_RANGE):
            middle_of_run = k - run // 2
            if run > 1:
                is_free = is_free_way(i, row, VIEW_COS[middle_of_run], VIEW_SIN[middle_of_run], p.range, robots, p)
                x = here_x + p.range * VIEW_COS[middle_of_run]
                y = here_y + p.range * VIEW_SIN[middle_of_run]
                _open(i, x, y, x, y, is_free, number, first, target_x, target_y, robots, p)
            run = 0
