"""How far the straight way to the target is free, as a scan tells.

A network would have to find out for every ray by itself what it means for a target of this bearing and distance.
"""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.records import WAY_PART
from sim.kernels.sensing import FAST

ZERO = np.float32(0.0)
ONE = np.float32(1.0)


@kernel(fastmath=FAST)
def see_way(i, bearing, distance, robots, geometry, p):
    """Write how much of the straight way to its target robot i sees to be free, and whether all of it is.

    Args:
        i: the robot.
        bearing: of the target as it believes, radians against the heading, left positive.
        distance: likewise, metres.
        robots: `sim.kernels.bundles.Robots`; `observations` is written.
        geometry: `sim.kernels.bundles.Geometry`.
        p: a row of PARAMETERS.
    """
    length = max(np.float64(distance) - p.arrival_distance, 0.0)
    free = min(length, np.float64(p.range))
    angles = geometry.ray_angles
    rays = angles.shape[0]
    step = angles[1] - angles[0]
    turn_cos = math.cos(step)
    turn_sin = math.sin(step)
    cos = math.cos(bearing)
    sin = math.sin(bearing)
    for lidar in range(p.lidars):
        # Where it stands along the way and across it, and where its ray points; each ray is the last one turned.
        x = p.mounts[lidar, 0] * cos + p.mounts[lidar, 1] * sin
        y = p.mounts[lidar, 1] * cos - p.mounts[lidar, 0] * sin
        first = angles[0] + p.mounts[lidar, 2] - bearing
        along = math.cos(first)
        across = math.sin(first)
        for k in range(lidar * rays, (lidar + 1) * rays):
            reading = robots.ranges[i, k]
            ahead = x + reading * along
            if reading < p.range and ZERO <= ahead < free and abs(y + reading * across) < p.near:
                free = ahead
            along, across = along * turn_cos - across * turn_sin, across * turn_cos + along * turn_sin
    at = p.part_places[WAY_PART]
    robots.observations[i, at] = np.float32(free / length) if length > 0.0 else ONE
    robots.observations[i, at + 1] = ONE if free >= length else ZERO
