"""What stands between a robot and the world: faults of its LiDAR, drift of its odometry, and drawing all of it anew."""

import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.random import normal, uniform
from sim.kernels.records import DISTANCE_NOISE, DROPOUT, FIELD_OF_VIEW, HEADING_NOISE, NOISE, RANGE, RATE

ZERO = np.float32(0.0)

AHEAD = math.radians(30.0)
"""Rays within this angle of the heading tell how free the way ahead is (the `clearance` reward)."""


@kernel()
def rays_ahead(angles, spread):
    """Which of the rays at `spread` times these angles, radians in order, point ahead: the first, and one past the last.

    Of a scanner so coarse that none does, those nearest to the heading.
    """
    nearest = abs(angles[0])
    for angle in angles:
        nearest = min(nearest, abs(angle))
    within = max(AHEAD, spread * nearest) + 1e-9
    first = 0
    while spread * abs(angles[first]) > within:
        first += 1
    last = first + 1
    while last < angles.shape[0] and spread * abs(angles[last]) <= within:
        last += 1
    return first, last


@kernel()
def _spread_rays(i, robots, geometry, p):
    """Let robot i's rays cover the field of view that it has drawn."""
    spread = robots.drawn[i, FIELD_OF_VIEW] / p.field_of_view
    room = robots.ray_cos.shape[1] // p.lidars
    for s in range(p.lidars):
        for k in range(geometry.ray_angles.shape[0]):
            angle = spread * geometry.ray_angles[k] + p.mounts[s, 2]
            robots.ray_cos[i, s * room + k] = np.float32(math.cos(angle))
            robots.ray_sin[i, s * room + k] = np.float32(math.sin(angle))
    robots.ahead[i, 0], robots.ahead[i, 1] = rays_ahead(geometry.ray_angles, spread)


@kernel()
def begin_episode(i, robots, geometry, p):
    """Draw what robot i is like in this episode; its pose is known, nothing is commanded yet, and the next scan is new."""
    for k in range(robots.drawn.shape[1]):
        low = p.spans[k, 0]
        high = p.spans[k, 1]
        if low < high:
            robots.drawn[i, k] = low + (high - low) * uniform(robots.records, i)
    if p.spans[FIELD_OF_VIEW, 0] < p.spans[FIELD_OF_VIEW, 1]:
        _spread_rays(i, robots, geometry, p)
    find_itself(i, robots)
    if robots.pending.shape[1]:
        robots.pending[i] = ZERO
    if robots.commands.shape[0]:
        robots.commands[i] = ZERO
    if robots.scan_ages.shape[0]:
        robots.scan_ages[i] = 0


@kernel()
def find_itself(i, robots):
    """Let robot i know its pose: with a new target, odometry starts anew, and its trail."""
    if robots.drift.shape[0]:
        robots.drift[i] = 0.0
    if robots.crumbs.shape[0]:
        robots.crumbs[i] = 0
    if robots.stays.shape[0]:
        robots.stays[i, 2] = -1.0
    if robots.views_kept.shape[0]:
        robots.views_kept[i] = 0


@kernel()
def drift(i, dx, dy, turn, robots):
    """Let robot i's believed pose drift while it truly moves by dx, dy, metres, and turns by `turn`, radians."""
    heading_noise = robots.drawn[i, HEADING_NOISE] * math.sqrt(abs(turn))
    if heading_noise > 0.0:
        turned = robots.drift[i, 2] + heading_noise * normal(robots.records, i)
        if abs(turned) > math.pi:  # a direction, and not how often it went round
            turned -= 2.0 * math.pi * math.floor((turned + math.pi) / (2.0 * math.pi))
        robots.drift[i, 2] = turned
    cos = math.cos(robots.drift[i, 2])
    sin = math.sin(robots.drift[i, 2])
    way = math.sqrt(dx * dx + dy * dy)
    stretch = 1.0
    if way > 0.0:
        stretch += robots.drawn[i, DISTANCE_NOISE] * math.sqrt(way) * normal(robots.records, i) / way
    robots.drift[i, 0] += stretch * (cos * dx - sin * dy) - dx
    robots.drift[i, 1] += stretch * (sin * dx + cos * dy) - dy


@kernel()
def _copy(i, source, target):
    """Copy row i."""
    for k in range(source.shape[1]):
        target[i, k] = source[i, k]


@kernel()
def perceive(i, robots, p):
    """Turn robot i's true scan into what it gets to see: a new scan with its faults, or the last one once more."""
    if robots.scan_ages.shape[0] == 0:
        _disturb(i, robots, p)
        return
    rate = robots.drawn[i, RATE]
    steps = max(1, int(1.0 / (rate * p.period) + 0.5)) if rate > 0.0 else 1
    if robots.scan_ages[i] % steps == 0:
        _disturb(i, robots, p)
        _copy(i, robots.ranges, robots.held_ranges)
    else:
        _copy(i, robots.held_ranges, robots.ranges)
    robots.scan_ages[i] += 1


@kernel()
def _disturb(i, robots, p):
    """Add the LiDAR's noise and dropouts to robot i's scan; what is beyond its own range is not seen."""
    limit = np.float32(robots.drawn[i, RANGE])
    noise = np.float32(robots.drawn[i, NOISE])
    dropout = np.float32(robots.drawn[i, DROPOUT])
    if noise == ZERO and dropout == ZERO and limit >= p.range:
        return
    for k in range(robots.ranges.shape[1]):
        if robots.ranges[i, k] >= limit:
            robots.ranges[i, k] = p.range
            continue
        if noise > ZERO:
            disturbance = np.float32(normal(robots.records, i))
            robots.ranges[i, k] = min(max(robots.ranges[i, k] + noise * disturbance, ZERO), p.range)
        if dropout > ZERO and uniform(robots.records, i) < dropout:
            robots.ranges[i, k] = p.range
