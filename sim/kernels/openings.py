"""Which openings a robot had better look into: by which its target would be nearest if what it has not seen were free.

An opening is where one reading of a view ends much farther away than the one beside it, or at the LiDAR's range: what lies
behind it was not seen from there. One that no other view shows is open (`sim.kernels.find_openings`). Views that the body
can go to from one another are linked (`sim.kernels.view_links`), so that a robot knows how far it is to each opening by ways
that it knows, and is told those that A* would choose (Hart, Nilsson and Raphael 1968): which does not go through a wall that
was seen (`sim.kernels.walls`). One that it was led to for long and came no nearer to counts farther
(`sim.kernels.patience`). The openings are the gaps of Tovar, Murrieta-Cid and LaValle (2007), "Distance-Optimal Navigation
in an Unknown Environment Without Sensing Distances".
"""

import math

import numpy as np

from sim.kernels.find_openings import SLACK, look_for_openings
from sim.kernels.narrow_gaps import close_gaps, leads_through_gap
from sim.kernels.options import kernel
from sim.kernels.patience import PATIENCE, TARGET_SLOT, forgive, lose_patience
from sim.kernels.records import OPENINGS_PART
from sim.kernels.room import DETOUR, FARTHER, OPENING_KINDS, OPENING_ROOM, STRAIGHT_ON, THROUGH_GAP, VIEW_ROOM
from sim.kernels.sensing import FAST
from sim.kernels.view_links import FAR, link_view, measure_ways
from sim.kernels.views import FREE_SIGHT, NO_SIGHT, SIGHT, SIGHT_THROUGH_GAP, sight_of
from sim.kernels.walls import count_walls

APART = 1.0
"""Metres that the openings that are told lie apart, at least."""

AT_HAND = 0.35
"""Metres from a view at which a robot is there, and goes on to what comes next."""

AT_GATE = 0.15
"""Metres from an opening's gate at which a robot is there, and goes on to the opening."""

LEAD_NUMBERS = 8
"""What is kept of an opening that is told: x, y, metres on known ways to it, metres that it is taken to be from there, its
view, whether the way from that is free, and x, y of its gate."""

ZERO = np.float32(0.0)
ONE = np.float32(1.0)
_SLACK = np.float32(SLACK)
_APART_SQUARED = np.float32(APART * APART)
_AT_GATE_SQUARED = np.float32(AT_GATE * AT_GATE)
_AT_HAND_SQUARED = np.float32(AT_HAND * AT_HAND)
_DETOUR = np.float32(DETOUR)
_FARTHER = np.array(FARTHER, np.float32)


@kernel(fastmath=FAST)
def _write_lead(i, lead, x, y, gate_x, gate_y, way, rest, view, is_free, robots):
    robots.leads[i, lead, 0] = x
    robots.leads[i, lead, 1] = y
    robots.leads[i, lead, 2] = way
    robots.leads[i, lead, 3] = rest
    robots.leads[i, lead, 4] = np.float32(view)
    robots.leads[i, lead, 5] = ONE if is_free else ZERO
    robots.leads[i, lead, 6] = gate_x
    robots.leads[i, lead, 7] = gate_y


@kernel(fastmath=FAST)
def _way_to(i, x, y, view, robots):
    """Metres from the newest view to a place that another one shows."""
    row = view % VIEW_ROOM
    dx = x - robots.view_places[i, row, 0]
    dy = y - robots.view_places[i, row, 1]
    return robots.view_ways[i, row] + np.float32(math.sqrt(dx * dx + dy * dy))


@kernel(fastmath=FAST)
def _is_apart(i, x, y, lead, robots):
    """Whether a place is no lead's before this one."""
    for before in range(lead):
        dx = x - robots.leads[i, before, 0]
        dy = y - robots.leads[i, before, 1]
        if robots.leads[i, before, 4] >= ZERO and dx * dx + dy * dy < _APART_SQUARED:
            return False
    return True


@kernel(fastmath=FAST)
def choose_leads(i, target_x, target_y, number, first, count, robots):
    """Write those openings by which the target would be nearest; the target itself where a view shows it."""
    robots.followed[i, 0] = -1
    for lead in range(count):
        robots.leads[i, lead, 4] = -ONE
        least = FAR
        for other in range(first, number + 1):
            seen = robots.view_sights[i, other % VIEW_ROOM]
            if seen > 0 and _is_apart(i, target_x, target_y, lead, robots):
                way = _way_to(i, target_x, target_y, other, robots)
                whole = way + robots.opening_dues[i, TARGET_SLOT]
                if seen == SIGHT:
                    whole += _DETOUR
                elif seen == SIGHT_THROUGH_GAP:
                    whole += _FARTHER[THROUGH_GAP]
                if whole < least:
                    least = whole
                    if lead == 0:
                        robots.followed[i, 0] = TARGET_SLOT
                    is_free = seen == FREE_SIGHT
                    _write_lead(i, lead, target_x, target_y, target_x, target_y, way, ZERO, other, is_free, robots)
        for k in range(OPENING_ROOM):
            view = robots.opening_views[i, k]
            if view < 0:
                continue
            x = robots.opening_places[i, k, 0]
            y = robots.opening_places[i, k, 1]
            way = _way_to(i, x, y, view, robots)
            rest = np.float32(math.sqrt((target_x - x) * (target_x - x) + (target_y - y) * (target_y - y)))
            rest += _DETOUR * np.float32(count_walls(robots.opening_walls[i, k]))
            manner = robots.opening_access[i, k]
            whole = way + rest + robots.opening_dues[i, k] + _FARTHER[manner]
            if whole < least and _is_apart(i, x, y, lead, robots):
                least = whole
                if lead == 0:
                    robots.followed[i, 0] = k
                gate = robots.opening_gates[i, k]
                _write_lead(i, lead, x, y, gate[0], gate[1], way, rest, view, manner == STRAIGHT_ON, robots)


@kernel(fastmath=FAST)
def _is_in_sight(i, dx, dy, heading, beside, slack, robots, geometry, p):
    """Whether the scan shows a place: the farthest (beside 1) or the nearest (-1) of three rays ends behind it or beyond."""
    squared = dx * dx + dy * dy
    if squared >= p.range * p.range:
        return False
    angles = geometry.ray_angles
    rays = angles.shape[0]
    step = angles[1] - angles[0]
    turned = np.float32(math.atan2(dy, dx)) - heading - p.mounts[0, 2] - angles[0]
    turned -= 2.0 * math.pi * math.floor((turned + 0.5 * step) / (2.0 * math.pi))
    ray = np.int64(math.floor(turned / step + 0.5))
    if ray >= rays and step * rays < 2.0 * math.pi - 1e-6:
        return False
    sight = robots.ranges[i, ray % rays]
    for k in range(2):
        other = robots.ranges[i, (ray + 2 * k - 1) % rays]
        sight = max(sight, other) if beside > 0 else min(sight, other)
    sight += slack
    return squared <= sight * sight


@kernel(fastmath=FAST)
def _next_place(i, lead, x, y, heading, number, robots, geometry, p):
    """Where to go first on the way to an opening, (x, y) in metres from the robot: its gate, or the last place in sight."""
    to_x = robots.leads[i, lead, 0] - x
    to_y = robots.leads[i, lead, 1] - y
    view = np.int64(robots.leads[i, lead, 4])
    gate_x = robots.leads[i, lead, 6] - x
    gate_y = robots.leads[i, lead, 7] - y
    beyond_x = to_x - gate_x
    beyond_y = to_y - gate_y
    is_ahead = beyond_x * beyond_x + beyond_y * beyond_y < to_x * to_x + to_y * to_y
    is_ahead &= gate_x * gate_x + gate_y * gate_y > _AT_GATE_SQUARED
    if is_ahead and _is_in_sight(i, gate_x, gate_y, heading, -1, ZERO, robots, geometry, p):
        return gate_x, gate_y
    if _is_in_sight(i, to_x, to_y, heading, 1, _SLACK, robots, geometry, p):
        return to_x, to_y
    dx = to_x
    dy = to_y
    while view >= 0:
        row = view % VIEW_ROOM
        dx = robots.view_places[i, row, 0] - x
        dy = robots.view_places[i, row, 1] - y
        if dx * dx + dy * dy < _AT_HAND_SQUARED:
            # It is there: on to what comes next.
            return to_x, to_y
        if _is_in_sight(i, dx, dy, heading, -1, ZERO, robots, geometry, p):
            return dx, dy
        to_x = dx
        to_y = dy
        view = robots.view_next[i, row]
    return dx, dy


@kernel(fastmath=FAST)
def see_openings(i, x, y, to_x, to_y, heading, is_kept, robots, geometry, p):
    """Write which openings robot i had better look into, the best one first.

    Args:
        i: the robot.
        x: metres, where it believes to be.
        y: likewise.
        to_x: metres from there to its target.
        to_y: likewise.
        heading: likewise, radians.
        is_kept: whether it has kept a view in this step.
        robots: `sim.kernels.bundles.Robots`; what is remembered of views and openings, and `observations`, are written.
        geometry: `sim.kernels.bundles.Geometry`.
        p: a row of PARAMETERS.
    """
    number = robots.views_kept[i] - 1
    first = max(0, number + 1 - VIEW_ROOM)
    count = p.part_options[OPENINGS_PART]
    if is_kept and number == 0:
        robots.followed[i, 0] = -1
        forgive(i, TARGET_SLOT, robots)
    else:
        robots.followed[i, 1] += 1
    is_chosen_anew = is_kept or robots.followed[i, 1] >= PATIENCE
    if is_chosen_anew:
        lose_patience(i, robots)
    if is_kept:
        close_gaps(i, number, first, x + to_x, y + to_y, robots, p)
        link_view(i, number, first, robots, p)
        look_for_openings(i, number, first, x + to_x, y + to_y, robots, p)
        measure_ways(i, number, first, robots)
        sight = sight_of(i, number % VIEW_ROOM, x + to_x, y + to_y, robots, p)
        if sight != NO_SIGHT and leads_through_gap(i, x, y, x + to_x, y + to_y, robots):
            sight = SIGHT_THROUGH_GAP
        robots.view_sights[i, number % VIEW_ROOM] = sight
    if is_chosen_anew:
        choose_leads(i, x + to_x, y + to_y, number, first, count, robots)
    out = robots.observations
    at = p.part_places[OPENINGS_PART]
    for lead in range(count):
        start = at + lead * OPENING_KINDS
        if robots.leads[i, lead, 4] < ZERO:
            for k in range(OPENING_KINDS):
                out[i, start + k] = ZERO
            continue
        dx, dy = _next_place(i, lead, x, y, heading, number, robots, geometry, p)
        distance = np.float32(math.sqrt(dx * dx + dy * dy))
        bearing = np.float32(math.atan2(dy, dx)) - heading
        out[i, start] = np.float32(math.sin(bearing))
        out[i, start + 1] = np.float32(math.cos(bearing))
        out[i, start + 2] = ONE - min(distance / p.range, ONE)
        out[i, start + 3] = robots.leads[i, lead, 2] / (robots.leads[i, lead, 2] + ONE)
        out[i, start + 4] = robots.leads[i, lead, 3] / (robots.leads[i, lead, 3] + ONE)
        out[i, start + 5] = robots.leads[i, lead, 5]
