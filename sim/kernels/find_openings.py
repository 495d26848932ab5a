"""Openings among what a robot has seen: edges of its views behind which no view shows anything."""

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

_HALF = np.float32(0.5)
_FULL = np.float32(FULL_RANGE)
_JUMP = np.float32(JUMP)
_SLACK = np.float32(SLACK)
_SAME_SQUARED = np.float32(SAME_OPENING * SAME_OPENING)
_WIDTH = np.float32(2.0 * SLIM)
_EDGES = (np.arange(VIEW_DIRECTIONS) + 1.0) * (2.0 * math.pi / VIEW_DIRECTIONS) - math.pi
_EDGE_COS, _EDGE_SIN = np.cos(_EDGES).astype(np.float32), np.sin(_EDGES).astype(np.float32)
# Of a full turn, on each side of an opening, where what narrows it may stand.
_BESIDE = VIEW_DIRECTIONS // 4


@kernel(fastmath=FAST)
def _is_narrow(i, row, near, beyond, step, robots, p):
    """Whether the body does not fit between where a reading ends and what stands across the opening beside it.

    Args:
        i: the robot.
        row: of the view.
        near: the reading's direction.
        beyond: the first direction on the other side.
        step: 1 or -1, towards that.
        robots: `sim.kernels.bundles.Robots`.
        p: a row of PARAMETERS.
    """
    scale = p.range / _FULL
    reading = np.float32(robots.views[i, row, near]) * scale
    x = reading * VIEW_COS[near]
    y = reading * VIEW_SIN[near]
    width = _WIDTH * p.near
    for k in range(_BESIDE):
        j = (beyond + step * k) % VIEW_DIRECTIONS
        other = np.float32(robots.views[i, row, j]) * scale
        dx = other * VIEW_COS[j] - x
        dy = other * VIEW_SIN[j] - y
        if dx * dx + dy * dy < width * width:
            return True
    return False


@kernel(fastmath=FAST)
def _open(i, x, y, is_free, number, first, target_x, target_y, robots, p):
    """Remember an opening of the newest view, unless an earlier one shows it."""
    for other in range(first, number):
        if shows(i, other % VIEW_ROOM, x, y, _SLACK, robots, p):
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
            if seen_from[i, k] < first or shows(i, row, x, y, _SLACK, robots, p):
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
            narrow = (
                _is_narrow(i, row, k, following, 1, robots, p)
                if right < left
                else _is_narrow(i, row, following, k, -1, robots, p)
            )
            if not narrow:
                nearer = min(right, left)
                is_free = is_free_way(i, row, _EDGE_COS[k], _EDGE_SIN[k], nearer - p.near, robots, p)
                away = (right + left) * _HALF
                x = here_x + away * _EDGE_COS[k]
                _open(i, x, here_y + away * _EDGE_SIN[k], is_free, number, first, target_x, target_y, robots, p)
        run = run + 1 if a == FULL_RANGE else 0
        if run > 0 and (run == FLAT_RUN or b != FULL_RANGE):
            middle_of_run = k - run // 2
            if run > 1:
                is_free = is_free_way(i, row, VIEW_COS[middle_of_run], VIEW_SIN[middle_of_run], p.range, robots, p)
                x = here_x + p.range * VIEW_COS[middle_of_run]
                _open(
                    i, x, here_y + p.range * VIEW_SIN[middle_of_run], is_free, number, first, target_x, target_y, robots, p
                )
            run = 0
