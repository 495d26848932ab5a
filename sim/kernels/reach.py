"""How far a robot could go straight on in each direction, as its scan shows.

A scan shows where things are, not between which of them a body has room. Where the body is taken for a point and things for
as much larger (Lozano-Perez 1983, "Spatial Planning: A Configuration Space Approach"), gaps that it fits through are seen at
once.
"""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.records import REACH_PART
from sim.kernels.sensing import FAST

DIRECTIONS = 4
"""Of each sector, of which the one that reaches farthest is told: a narrow gap beside a sector's middle is not missed."""


@kernel(fastmath=FAST)
def see_reach(i, robots, geometry, p):
    """Write how far robot i could go, sector by sector from right to left, beginning behind it: d / (d + reach).

    Args:
        i: the robot.
        robots: `sim.kernels.bundles.Robots`; `reach` and `observations` are written.
        geometry: `sim.kernels.bundles.Geometry`.
        p: a row of PARAMETERS; `near` is d, the distance on all sides that must stay free.
    """
    sectors = p.reach_sectors
    near = np.float64(p.near)
    count = sectors * DIRECTIONS
    step = 2.0 * math.pi / count
    turn_cos = math.cos(step)
    turn_sin = math.sin(step)
    reach = robots.reach
    for k in range(count):
        reach[i, k] = p.range
    angles = geometry.ray_angles
    rays = angles.shape[0]
    for lidar in range(p.lidars):
        mount_x = p.mounts[lidar, 0]
        mount_y = p.mounts[lidar, 1]
        for ray in range(rays):
            reading = float(robots.ranges[i, lidar * rays + ray])
            if reading >= p.range:
                continue
            distance = reading
            towards = angles[ray] + p.mounts[lidar, 2]
            if mount_x != 0.0 or mount_y != 0.0:
                x = mount_x + reading * math.cos(towards)
                y = mount_y + reading * math.sin(towards)
                distance = math.sqrt(x * x + y * y)
                towards = math.atan2(y, x)
            # In the directions that pass it at less than d: of what is nearer than d, half of all.
            half = math.asin(near / distance) if distance > near else 0.5 * math.pi
            first = np.int64(math.ceil((towards - half + math.pi) / step - 0.5))
            last = np.int64(math.floor((towards + half + math.pi) / step - 0.5))
            aside = (first + 0.5) * step - math.pi - towards
            along = distance * math.cos(aside)
            across = distance * math.sin(aside)
            k = first % count
            for _ in range(first, last + 1):
                free = max(along - math.sqrt(max(near * near - across * across, 0.0)), 0.0)
                reach[i, k] = min(reach[i, k], free)
                along, across = along * turn_cos - across * turn_sin, across * turn_cos + along * turn_sin
                k = k + 1 if k + 1 < count else 0
    at = p.part_places[REACH_PART]
    for sector in range(sectors):
        farthest = 0.0
        for k in range(sector * DIRECTIONS, (sector + 1) * DIRECTIONS):
            farthest = max(farthest, reach[i, k])
        robots.observations[i, at + sector] = np.float32(near / (near + farthest))
