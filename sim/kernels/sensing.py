"""Rays and clearance against walls, circles, oriented boxes and movers, for one robot at a time.

All lengths are float32 metres in the arena's own frame: callers subtract the tile's origin in float64 first. Over random
scenes the ranges agree with Chipmunk's exact queries within 1e-4 m (tests/sim/test_sensing.py keeps it so).
"""

import math

import numpy as np

from sim.kernels.options import kernel

ZERO = np.float32(0.0)
ONE = np.float32(1.0)
FAR = np.float32(1e6)  # m; the fast floating-point rules below do without infinities
MARGIN = np.float32(0.01)  # m
TINY = np.float32(1e-12)  # keeps divisions by a direction finite; far below any direction that a float32 angle gives

FAST = {"nnan", "ninf", "nsz", "arcp", "contract", "afn", "reassoc"}
"""Floating-point freedoms that let the ray loops vectorise; each of them is within the 1e-4 m that the tests allow."""


@kernel(fastmath=FAST)
def clearance_at(x, y, index, bounds, circles, boxes):
    """Signed distance from a point to the nearest surface of arena `index`, metres (see `sim.arenas.free_distance`)."""
    distance = min(bounds[index, 0] - abs(x), bounds[index, 1] - abs(y))
    for j in range(circles.shape[1]):
        radius = circles[index, j, 2]
        if radius > ZERO:
            fx = circles[index, j, 0] - x
            fy = circles[index, j, 1] - y
            distance = min(distance, math.sqrt(fx * fx + fy * fy) - radius)
    for j in range(boxes.shape[1]):
        half_length = boxes[index, j, 2]
        if half_length > ZERO:
            gx = x - boxes[index, j, 0]
            gy = y - boxes[index, j, 1]
            cos = boxes[index, j, 4]
            sin = boxes[index, j, 5]
            along = abs(cos * gx + sin * gy) - half_length
            across = abs(cos * gy - sin * gx) - boxes[index, j, 3]
            px = max(along, ZERO)
            py = max(across, ZERO)
            distance = min(distance, math.sqrt(px * px + py * py) + min(max(along, across), ZERO))
    return distance


@kernel(fastmath=FAST)
def nearest_of(ranges, row, first, last):
    """The smallest of ranges[row, first:last], which is not empty."""
    nearest = ranges[row, first]
    for k in range(first + 1, last):
        nearest = min(nearest, ranges[row, k])
    return nearest


@kernel(fastmath=FAST)
def _shorten_by_circle(fx, fy, radius, gap, limit, ranges, row, dx, dy):
    """Shorten the rays (dx, dy) that meet a circle whose centre is (fx, fy) away and whose surface `gap`."""
    rays = dx.shape[0]
    if gap <= ZERO:
        for i in range(rays):
            ranges[row, i] = ZERO
        return
    radius_squared = radius * radius
    for i in range(rays):
        ahead = fx * dx[i] + fy * dy[i]
        # The perpendicular distance as a cross product: |f|² - ahead² would cancel.
        aside = fx * dy[i] - fy * dx[i]
        square = radius_squared - aside * aside
        hit = ahead - math.sqrt(max(square, ZERO))
        ranges[row, i] = min(ranges[row, i], hit if (square >= ZERO and hit >= ZERO) else limit)


@kernel(fastmath=FAST)
def sense(x, y, heading, index, bounds, circles, boxes, ray_cos, ray_sin, limit, looks_ahead, ranges, row, dx, dy):
    """Fill row `row` of `ranges` (n, rays) with the scan from a pose and return the clearance of the point, metres.

    `dx` and `dy` are scratch rows, (rays,) float32; `limit` is the LiDAR's range, which a ray without a hit reads.
    A ray that starts inside an obstacle reads 0.
    """
    rays = ray_cos.shape[0]
    cos_heading = np.float32(math.cos(heading))
    sin_heading = np.float32(math.sin(heading))
    half_width = bounds[index, 0]
    half_height = bounds[index, 1]
    clearance = min(half_width - abs(x), half_height - abs(y))
    for i in range(rays):
        ux = cos_heading * ray_cos[i] - sin_heading * ray_sin[i]
        uy = sin_heading * ray_cos[i] + cos_heading * ray_sin[i]
        dx[i] = ux
        dy[i] = uy
        to_side = (half_width - (x if ux > ZERO else -x)) / max(abs(ux), TINY)
        to_end = (half_height - (y if uy > ZERO else -y)) / max(abs(uy), TINY)
        ranges[row, i] = max(min(limit, min(to_side, to_end)), ZERO)
    for j in range(circles.shape[1]):
        radius = circles[index, j, 2]
        if radius <= ZERO:
            continue
        fx = circles[index, j, 0] - x
        fy = circles[index, j, 1] - y
        squared = fx * fx + fy * fy
        gap = math.sqrt(squared) - radius
        clearance = min(clearance, gap)
        if gap >= limit or (looks_ahead and cos_heading * fx + sin_heading * fy < -radius):
            continue
        _shorten_by_circle(fx, fy, radius, gap, limit, ranges, row, dx, dy)
    for j in range(boxes.shape[1]):
        half_length = boxes[index, j, 2]
        if half_length <= ZERO:
            continue
        half_breadth = boxes[index, j, 3]
        cos = boxes[index, j, 4]
        sin = boxes[index, j, 5]
        gx = x - boxes[index, j, 0]
        gy = y - boxes[index, j, 1]
        # The robot in the box's frame.
        lx = cos * gx + sin * gy
        ly = cos * gy - sin * gx
        along = abs(lx) - half_length
        across = abs(ly) - half_breadth
        px = max(along, ZERO)
        py = max(across, ZERO)
        gap = math.sqrt(px * px + py * py) + min(max(along, across), ZERO)
        clearance = min(clearance, gap)
        if gap >= limit:
            continue
        if looks_ahead:
            reach = math.sqrt(half_length * half_length + half_breadth * half_breadth)
            if cos_heading * gx + sin_heading * gy > reach:
                continue
        for i in range(rays):
            ux = cos * dx[i] + sin * dy[i]
            uy = cos * dy[i] - sin * dx[i]
            ix = ONE / (ux if abs(ux) > TINY else TINY)
            iy = ONE / (uy if abs(uy) > TINY else TINY)
            ex = abs(ix) * half_length
            ey = abs(iy) * half_breadth
            mx = -lx * ix
            my = -ly * iy
            enter = max(mx - ex, my - ey)
            leave = min(mx + ex, my + ey)
            ranges[row, i] = min(ranges[row, i], max(enter, ZERO) if (leave >= enter and leave >= ZERO) else limit)
    return clearance


@kernel(fastmath=FAST)
def disc_clearance(x, y, tile, discs):
    """Signed distance from a point to the nearest mover of a tile, metres; `FAR` where there is none."""
    distance = FAR
    for j in range(discs.shape[1]):
        radius = discs[tile, j, 2]
        if radius > ZERO:
            fx = discs[tile, j, 0] - x
            fy = discs[tile, j, 1] - y
            distance = min(distance, math.sqrt(fx * fx + fy * fy) - radius)
    return distance


@kernel(fastmath=FAST)
def swept_clearance(x, y, dx, dy, tile, discs):
    """The same, smallest while the point came to (x, y) by (dx, dy) and each mover by its last step, both straight."""
    distance = FAR
    for j in range(discs.shape[1]):
        radius = discs[tile, j, 2]
        if radius > ZERO:
            # The mover as the point sees it, and how it came there.
            fx = discs[tile, j, 0] - x
            fy = discs[tile, j, 1] - y
            sx = discs[tile, j, 3] - dx
            sy = discs[tile, j, 4] - dy
            back = min(max((fx * sx + fy * sy) / max(sx * sx + sy * sy, TINY), ZERO), ONE)
            fx -= back * sx
            fy -= back * sy
            distance = min(distance, math.sqrt(fx * fx + fy * fy) - radius)
    return distance


@kernel(fastmath=FAST, inline="always")
def sense_discs(x, y, tile, discs, limit, looks_ahead, ranges, row, dx, dy, clearance):
    """Shorten row `row` of `ranges` by a tile's movers; return `clearance` or, where it is smaller, that from them.

    `dx` and `dy` are the rays' directions as `sense` leaves them.
    """
    if discs.shape[1] == 0:
        return clearance
    # The middle of the field of view, at most as long as 1: what is behind it is out of sight of rays that look ahead.
    middle = dx.shape[0] // 2
    ahead_x = np.float32(0.5) * (dx[middle] + dx[dx.shape[0] - 1 - middle])
    ahead_y = np.float32(0.5) * (dy[middle] + dy[dx.shape[0] - 1 - middle])
    for j in range(discs.shape[1]):
        radius = discs[tile, j, 2]
        if radius <= ZERO:
            continue
        fx = discs[tile, j, 0] - x
        fy = discs[tile, j, 1] - y
        squared = fx * fx + fy * fy
        # Most are out of reach, which takes no root to see; the margin is far above rounding.
        reach = max(limit, clearance) + radius + MARGIN
        if squared >= reach * reach:
            continue
        gap = math.sqrt(squared) - radius
        clearance = min(clearance, gap)
        if gap >= limit or (looks_ahead and ahead_x * fx + ahead_y * fy < -radius):
            continue
        _shorten_by_circle(fx, fy, radius, gap, limit, ranges, row, dx, dy)
    return clearance


@kernel(allocates=True)
def scan_poses(poses, maps, bounds, circles, boxes, ray_cos, ray_sin, limit, looks_ahead, ranges):
    """Fill `ranges` (n, rays) with the scans from `poses` (n, 3), each in the arena that `maps` (n,) names.

    `ray_cos` and `ray_sin` are (n, rays), or (1, rays) where all scanners are alike.
    """
    dx = np.empty(ray_cos.shape[1], np.float32)
    dy = np.empty(ray_cos.shape[1], np.float32)
    for i in range(poses.shape[0]):
        own = min(i, ray_cos.shape[0] - 1)
        sense(
            poses[i, 0], poses[i, 1], poses[i, 2], maps[i], bounds, circles, boxes, ray_cos[own], ray_sin[own],
            limit, looks_ahead, ranges, i, dx, dy,
        )  # fmt: skip


@kernel()
def clearance_points(points, maps, bounds, circles, boxes, result):
    """Fill `result` (n,) with the clearances of `points` (n, 2), each in the arena that `maps` (n,) names."""
    for i in range(points.shape[0]):
        result[i] = clearance_at(points[i, 0], points[i, 1], maps[i], bounds, circles, boxes)
