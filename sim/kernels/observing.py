"""What a robot is told: the numbers that `sim.observations` explains."""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.records import EXTRA, PAPER
from sim.kernels.sensing import FAST, nearest_of

ZERO = np.float32(0.0)
ONE = np.float32(1.0)
PI = np.float32(math.pi)
TWO_PI = np.float32(2.0 * math.pi)


@kernel(fastmath=FAST)
def wrapped(angle):
    """An angle of less than one and a half turns in [-pi, pi]."""
    if angle > PI:
        angle -= TWO_PI
    elif angle < -PI:
        angle += TWO_PI
    return min(max(angle, -PI), PI)


@kernel(fastmath=FAST)
def bearing_of(dx, dy, heading):
    """Direction of (dx, dy) against the heading, in [-pi, pi], left positive."""
    return wrapped(np.float32(math.atan2(dy, dx)) - heading)


@kernel(fastmath=FAST, inline="always")
def observe(i, robots, geometry, p):
    """Write robot i's newest observation before the earlier ones; `sim.observations` says what each number is."""
    record = robots.records[i]
    out = robots.observations
    size = p.batches + EXTRA
    for k in range((p.frames - 1) * size - 1, -1, -1):
        out[i, k + size] = out[i, k]
    rays = p.rays_per_batch
    paper = p.observation == PAPER
    for k in range(p.batches):
        nearest = nearest_of(robots.ranges, i, k * rays, (k + 1) * rays)
        out[i, k] = nearest / p.range if paper else p.near / max(nearest, p.near)
    k = p.batches
    out[i, k] = record.linear
    out[i, k + 1] = record.angular
    heading = robots.poses[i, 2]
    dx = robots.targets[i, 0] - robots.poses[i, 0]
    dy = robots.targets[i, 1] - robots.poses[i, 1]
    distance = record.distance
    if p.drifts:
        dx -= np.float32(robots.drift[i, 0])
        dy -= np.float32(robots.drift[i, 1])
        distance = np.float32(math.sqrt(dx * dx + dy * dy))
        heading = wrapped(heading + np.float32(robots.drift[i, 2]))
    bearing = bearing_of(dx, dy, heading)
    if paper:
        width = geometry.bounds[record.map, 0]
        height = geometry.bounds[record.map, 1]
        direction = np.float32(math.atan2(dy, dx))
        diagonal = np.float32(2.0) * np.float32(math.sqrt(width * width + height * height))
        out[i, k + 2] = min(distance / diagonal, ONE) if p.drifts else distance / diagonal
        out[i, k + 3] = (direction if direction >= ZERO else direction + TWO_PI) / TWO_PI
        out[i, k + 4] = (heading if heading >= ZERO else heading + TWO_PI) / TWO_PI
    else:
        out[i, k + 2] = distance / (distance + ONE)
        out[i, k + 3] = bearing / PI
        out[i, k + 4] = heading / PI
    out[i, k + 5] = abs(bearing) / PI


@kernel(fastmath=FAST, inline="always")
def observe_first(i, robots, geometry, p):
    """Write robot i's first observation of an episode, which stands for the earlier ones too."""
    observe(i, robots, geometry, p)
    size = p.batches + EXTRA
    for k in range(size, p.frames * size):
        robots.observations[i, k] = robots.observations[i, k - size]
