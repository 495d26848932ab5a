"""Ways between the views that a robot has kept: which of them it can go to from one another, and how far that is."""

import math

import numpy as np

from sim.kernels.narrow_gaps import leads_through_gap
from sim.kernels.options import kernel
from sim.kernels.room import LINK_ROOM, VIEW_ROOM
from sim.kernels.sensing import FAST
from sim.kernels.views import FREE_SIGHT, sight_of

SWEEPS = 8
"""Times that ways between views are looked through, there and back, at most."""

ZERO = np.float32(0.0)
FAR = np.float32(1e9)


@kernel(fastmath=FAST)
def link_view(i, number, first, robots, p):
    """Link the newest view to the one before it, and to the oldest and the nearest of each run that it can go to."""
    links = robots.view_links
    row = number % VIEW_ROOM
    for k in range(LINK_ROOM):
        links[i, row, k] = -1
    if number == first:
        return
    links[i, row, 0] = number - 1
    count = 1
    x = robots.view_places[i, row, 0]
    y = robots.view_places[i, row, 1]
    least = FAR
    nearest = -1
    oldest = -1
    for other in range(number - 2, first - 2, -1):
        is_seen = False
        squared = FAR
        if other >= first:
            there = other % VIEW_ROOM
            there_x = robots.view_places[i, there, 0]
            there_y = robots.view_places[i, there, 1]
            is_seen = sight_of(i, row, there_x, there_y, robots, p) == FREE_SIGHT
            is_seen = is_seen and not leads_through_gap(i, x, y, there_x, there_y, robots)
            squared = (there_x - x) * (there_x - x) + (there_y - y) * (there_y - y)
        if is_seen:
            if squared < least:
                least = squared
                nearest = other
            oldest = other
        elif oldest >= 0:
            if count < LINK_ROOM:
                links[i, row, count] = oldest
                count += 1
            if nearest != oldest and count < LINK_ROOM:
                links[i, row, count] = nearest
                count += 1
            least = FAR
            nearest = -1
            oldest = -1


@kernel(fastmath=FAST)
def measure_ways(i, number, first, robots):
    """Write how far it is from the newest view to every other one by links, and by which view it goes there."""
    ways = robots.view_ways
    towards = robots.view_next
    places = robots.view_places
    for other in range(first, number):
        ways[i, other % VIEW_ROOM] = FAR
    ways[i, number % VIEW_ROOM] = ZERO
    towards[i, number % VIEW_ROOM] = -1
    for sweep in range(2 * SWEEPS):
        has_changed = False
        for k in range(number - first + 1):
            one = number - k if sweep % 2 == 0 else first + k
            row = one % VIEW_ROOM
            for link in range(LINK_ROOM):
                other = robots.view_links[i, row, link]
                if other < 0:
                    break
                if other < first:
                    continue
                there = other % VIEW_ROOM
                dx = places[i, there, 0] - places[i, row, 0]
                dy = places[i, there, 1] - places[i, row, 1]
                apart = np.float32(math.sqrt(dx * dx + dy * dy))
                if ways[i, row] + apart < ways[i, there]:
                    ways[i, there] = ways[i, row] + apart
                    towards[i, there] = one
                    has_changed = True
                elif ways[i, there] + apart < ways[i, row]:
                    ways[i, row] = ways[i, there] + apart
                    towards[i, row] = other
                    has_changed = True
        if not has_changed:
            break
