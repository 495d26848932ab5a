"""Since when a robot knows what it sees: views that it keeps on its way, and which of them showed it before.

Who saw from afar that a bay is closed, and turned away, finds no crumb in it when it comes by again. What it remembers of
what it saw tells the bay from a place that is new, as the frontiers of a map would (Yamauchi 1997, "A Frontier-Based
Approach for Autonomous Exploration"), without a map.
"""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.records import KNOWN_PART
from sim.kernels.room import SHORT_OF, VIEW_ROOM
from sim.kernels.sensing import FAST
from sim.kernels.trail import SEEN_BEHIND
from sim.kernels.views import FULL_RANGE, VIEW_DIRECTIONS

SECTOR_EDGE = 1e-3
"""Of a sector: a ray that lies so near to its end belongs to the next one, however it is rounded."""

ZERO = np.float32(0.0)
ONE = np.float32(1.0)
PI = np.float32(math.pi)
TWO_PI = np.float32(2.0 * math.pi)
_PER_RADIAN = np.float32(VIEW_DIRECTIONS / (2.0 * math.pi))
_BEHIND = np.float32(SEEN_BEHIND)
_SHORT = np.float32(SHORT_OF)
_HALF = np.float32(0.5)
_FULL = np.float32(FULL_RANGE)
_EDGE = np.float32(SECTOR_EDGE)
_WHOLE_MEMORY = np.float32(math.log(1.0 + VIEW_ROOM))


@kernel(fastmath=FAST)
def _find_farthest(i, readings, towards, sectors, robots, geometry, p):
    """Write the farthest reading of each sector, -1 where there is none, and where its ray points against the heading."""
    out = robots.observations
    angles = geometry.ray_angles
    for k in range(sectors):
        out[i, readings + k] = -ONE
    for ray in range(angles.shape[0]):
        angle = np.float32(angles[ray] + p.mounts[0, 2])
        angle -= TWO_PI * np.float32(math.floor((angle + PI) / TWO_PI))
        k = min(np.int64((angle + PI) / TWO_PI * np.float32(sectors) + _EDGE), sectors - 1)
        if robots.ranges[i, ray] > out[i, readings + k]:
            out[i, readings + k] = robots.ranges[i, ray]
            out[i, towards + k] = angle


@kernel(fastmath=FAST)
def see_known(i, x, y, to_x, to_y, heading, robots, geometry, p):
    """Write since when robot i knows what it sees, from the views that it has kept.

    If it is told, also how much nearer to its target that is. Sector by sector from right to left, beginning behind it.

    Args:
        i: the robot.
        x: metres, where it believes to be.
        y: likewise.
        to_x: metres from there to its target.
        to_y: likewise.
        heading: likewise, radians.
        robots: `sim.kernels.bundles.Robots`; `observations` is written.
        geometry: `sim.kernels.bundles.Geometry`.
        p: a row of PARAMETERS.
    """
    kept = robots.views_kept[i]
    out = robots.observations
    sectors = p.known_sectors
    freshness = p.part_places[KNOWN_PART]
    nearness = freshness + sectors
    progress = nearness + sectors
    is_told = p.part_options[KNOWN_PART]
    left = np.float32(math.sqrt(to_x * to_x + to_y * to_y))
    _find_farthest(i, freshness, nearness, sectors, robots, geometry, p)
    range_squared = p.range * p.range
    for k in range(sectors):
        reading = out[i, freshness + k]
        if reading < ZERO:
            out[i, freshness + k] = ZERO
            out[i, nearness + k] = ZERO
            if is_told:
                out[i, progress + k] = ZERO
            continue
        ahead = max(reading - _SHORT, reading * _HALF)
        towards = out[i, nearness + k] + heading
        ahead_x = ahead * np.float32(math.cos(towards))
        ahead_y = ahead * np.float32(math.sin(towards))
        if is_told:
            beside_x = to_x - ahead_x
            beside_y = to_y - ahead_y
            out[i, progress + k] = (left - np.float32(math.sqrt(beside_x * beside_x + beside_y * beside_y))) / p.range
        end_x = x + ahead_x
        end_y = y + ahead_y
        nearest = range_squared
        first = kept - 1  # of the views that showed the end; the newest one tells no more than now
        for number in range(max(0, kept - VIEW_ROOM), kept):
            row = number % VIEW_ROOM
            dx = end_x - robots.view_places[i, row, 0]
            dy = end_y - robots.view_places[i, row, 1]
            squared = dx * dx + dy * dy
            if squared >= range_squared:
                continue
            nearest = min(nearest, squared)
            if number < first:
                direction = np.int64((np.float32(math.atan2(dy, dx)) + PI) * _PER_RADIAN)
                sight = robots.views[i, row, min(direction, VIEW_DIRECTIONS - 1)] * p.range / _FULL + _BEHIND
                if squared < sight * sight:
                    first = number
        out[i, freshness + k] = ONE - np.float32(math.log(np.float32(kept - first))) / _WHOLE_MEMORY
        out[i, nearness + k] = ONE - np.float32(math.sqrt(nearest)) / p.range
