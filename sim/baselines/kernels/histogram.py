"""The inner loop of VFH+, see `sim.baselines.vfh`."""

import math

import numpy as np

from sim.baselines.kernels import kernel

SECTORS = 72
"""Of the polar histogram: five degrees each."""

_WIDE = 16  # sectors from which on an opening is wide, as in the paper
_TARGET, _HEADING, _PREVIOUS = 5.0, 2.0, 2.0  # the paper's weights for a robot that seeks its target


@kernel(inline="always")
def _apart(a, b):
    """Sectors between two directions."""
    d = abs(a - b) % SECTORS
    return min(d, SECTORS - d)


@kernel(inline="always")
def _cost(sector, target, previous):
    return _TARGET * _apart(sector, target) + _HEADING * _apart(sector, 0.0) + _PREVIOUS * _apart(sector, previous)


@kernel(allocates=True)
def steer_all(
    ranges, limit, angles, spacing, bearings, distances, radius, keep, near, far, top_linear, top_angular, period, blocked,
    previous, actions,
):  # fmt: skip
    """Write the actions (n, 2) of n robots, as fractions of the limits.

    Args:
        ranges: (n, rays) metres.
        limit: what a ray reads that hits nothing.
        angles: (n, rays) against the heading, radians.
        spacing: radians from one ray to the next.
        bearings: (n,) of the targets, radians.
        distances: (n,) of the targets, metres.
        radius: of a disc around the body, metres.
        keep: metres beside it that count as blocked.
        near: metres from which on an obstacle blocks a sector that was free.
        far: metres up to which one blocks a sector that was blocked.
        top_linear: m/s.
        top_angular: rad/s.
        period: seconds of a step.
        blocked: (n, SECTORS) bool, the binary histograms of the step before; written.
        previous: (n,) sectors chosen in the step before; written.
        actions: (n, 2), written.
    """
    width = 2.0 * math.pi / SECTORS
    closest = np.empty(SECTORS)
    for i in range(ranges.shape[0]):
        closest[:] = 0.0  # what no ray sees is not gone to
        for k in range(angles.shape[1]):
            low = math.floor((angles[i, k] - 0.5 * spacing) / width)
            high = math.ceil((angles[i, k] + 0.5 * spacing) / width)
            for s in range(low, high + 1):
                closest[s % SECTORS] = limit
        for k in range(angles.shape[1]):
            distance = ranges[i, k]
            if distance >= limit or distance > far:
                continue
            enlarged = math.asin(min(1.0, (radius + keep) / max(distance, 1e-6)))
            low = math.ceil((angles[i, k] - enlarged) / width - 0.5)
            high = math.floor((angles[i, k] + enlarged) / width + 0.5)
            for s in range(low, high + 1):
                closest[s % SECTORS] = min(closest[s % SECTORS], distance)
        reach = min(near, max(distances[i], radius + keep))
        free = 0
        for s in range(SECTORS):
            if closest[s] < reach:
                blocked[i, s] = True
            elif closest[s] >= min(far, limit, reach * far / near):
                blocked[i, s] = False
            free += not blocked[i, s]
        target = bearings[i] / width
        chosen = -1.0
        best = np.inf
        if free == SECTORS:
            chosen = target % SECTORS
        elif free > 0:
            first = 0
            while not blocked[i, first]:
                first += 1
            s = 0
            while s < SECTORS:  # openings, once round from a blocked sector on
                if blocked[i, (first + s) % SECTORS]:
                    s += 1
                    continue
                begin = s
                while s < SECTORS and not blocked[i, (first + s) % SECTORS]:
                    s += 1
                low = first + begin
                size = s - begin
                if size < _WIDE:
                    middle = (low + 0.5 * (size - 1)) % SECTORS
                    if _cost(middle, target, previous[i]) < best:
                        best = _cost(middle, target, previous[i])
                        chosen = middle
                else:
                    for side in ((low + 0.5 * _WIDE) % SECTORS, (low + size - 1 - 0.5 * _WIDE) % SECTORS):
                        if _cost(side, target, previous[i]) < best:
                            best = _cost(side, target, previous[i])
                            chosen = side
                    beyond = (target - low) % SECTORS
                    if 0.5 * _WIDE <= beyond <= size - 1 - 0.5 * _WIDE and _cost(target, target, previous[i]) < best:
                        best = _cost(target, target, previous[i])
                        chosen = target % SECTORS
        if chosen < 0.0:
            actions[i, 0] = 0.0
            actions[i, 1] = 1.0 if bearings[i] >= 0.0 else -1.0
            continue
        previous[i] = chosen
        turn = (chosen if chosen <= 0.5 * SECTORS else chosen - SECTORS) * width
        ahead = limit
        for k in range(angles.shape[1]):
            along = ranges[i, k] * math.cos(angles[i, k])
            aside = ranges[i, k] * math.sin(angles[i, k])
            if ranges[i, k] < limit and along > 0.0 and abs(aside) < radius + 0.5 * keep:
                ahead = min(ahead, along)
        speed = max(math.cos(turn), 0.0) * min(1.0, max(ahead - radius - keep, 0.0) / (4.0 * top_linear * period))
        speed = min(speed, distances[i] / (top_linear * period))
        actions[i, 0] = max(speed, 0.0)
        actions[i, 1] = min(max(turn / (2.0 * period) / top_angular, -1.0), 1.0)
