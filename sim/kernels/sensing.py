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


@kernel(fastmath=FAST, inline="always")
def nearest_of(ranges, row, first, last):
    """The smallest of ranges[row, first:last], which is not empty."""
    nearest = ranges[row, first]
    for k in range(first + 1, last):
        nearest = min(nearest, ranges[row, k])
    return nearest


@kernel(fastmath=FAST)
def _shorten_by_circle(fx, fy, radius, limit, ranges, dx, dy):
    """Shorten the rays (dx, dy) that meet a circle whose centre is (fx, fy) away."""
    rays = dx.shape[0]
    radius_squared = radius * radius
    if fx * fx + fy * fy <= radius_squared:
        for i in range(rays):
            ranges[i] = ZERO
        return
    for i in range(rays):
        ahead = fx * dx[i] + fy * dy[i]
        # The perpendicular distance as a cross product: |f|² - ahead² would cancel.
        aside = fx * dy[i] - fy * dx[i]
        square = radius_squared - aside * aside
        hit = ahead - math.sqrt(max(square, ZERO))
        ranges[i] = min(ranges[i], hit if (square >= ZERO and hit >= ZERO) else limit)


@kernel(fastmath=FAST, inline="always")
def sense(
    x, y, cos_heading, sin_heading, index, bounds, circles, boxes, ray_cos, ray_sin, limit, looks_ahead, ranges, dx, dy, near
):
    """Fill `ranges` with the scan from a pose and return the clearance of the point, metres.

    `limit` is the LiDAR's range, which a ray without a hit reads. A ray that starts inside an obstacle reads 0.

    `ray_cos`, `ray_sin`, `ranges` and the scratch `dx`, `dy` are float32, and filled up as `sim.lidar.padded` does it; what
    a ray beyond the scanner's reads means nothing. `near` is int32 scratch for as many circles or boxes as there are. Which
    of these can be seen is listed first, without a branch, since no processor can foretell it: with thousands of robots,
    branches took more time than the rays.
    """
    rays = ray_cos.shape[0]
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
        ranges[i] = max(min(limit, min(to_side, to_end)), ZERO)
    # What ends further behind than this is out of sight.
    back = ZERO if looks_ahead else -FAR
    count = 0
    for j in range(circles.shape[1]):
        radius = circles[index, j, 2]
        fx = circles[index, j, 0] - x
        fy = circles[index, j, 1] - y
        gap = math.sqrt(fx * fx + fy * fy) - radius if radius > ZERO else FAR
        clearance = min(clearance, gap)
        near[count] = j
        count += (gap < limit) & (cos_heading * fx + sin_heading * fy + radius >= back)
    for k in range(count):
        j = near[k]
        _shorten_by_circle(circles[index, j, 0] - x, circles[index, j, 1] - y, circles[index, j, 2], limit, ranges, dx, dy)
    count = 0
    nearest = FAR
    deepest = ZERO
    for j in range(boxes.shape[1]):
        half_length = boxes[index, j, 2]
        half_breadth = boxes[index, j, 3]
        cos = boxes[index, j, 4]
        sin = boxes[index, j, 5]
        gx = x - boxes[index, j, 0]
        gy = y - boxes[index, j, 1]
        along = abs(cos * gx + sin * gy) - half_length
        across = abs(cos * gy - sin * gx) - half_breadth
        px = max(along, ZERO)
        py = max(across, ZERO)
        squared = px * px + py * py if half_length > ZERO else FAR
        nearest = min(nearest, squared)
        deepest = min(deepest, max(along, across))
        ahead = -cos_heading * gx - sin_heading * gy
        near[count] = j
        visible = (ahead >= back) | (ahead * ahead <= half_length * half_length + half_breadth * half_breadth)
        count += (squared < limit * limit) & visible
    clearance = min(clearance, math.sqrt(nearest) + deepest)
    for k in range(count):
        j = near[k]
        half_length = boxes[index, j, 2]
        half_breadth = boxes[index, j, 3]
        cos = boxes[index, j, 4]
        sin = boxes[index, j, 5]
        gx = x - boxes[index, j, 0]
        gy = y - boxes[index, j, 1]
        # The robot in the box's frame.
        lx = cos * gx + sin * gy
        ly = cos * gy - sin * gx
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
            ranges[i] = min(ranges[i], max(enter, ZERO) if (leave >= enter and leave >= ZERO) else limit)
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
def sense_discs(x, y, cos_heading, sin_heading, tile, discs, limit, looks_ahead, ranges, dx, dy, near, clearance):
    """Shorten `ranges` by a tile's movers; return `clearance` or, where it is smaller, that from them.

    The arrays are those of `sense`, after it.
    """
    if discs.shape[1] == 0:
        return clearance
    back = ZERO if looks_ahead else -FAR
    count = 0
    for j in range(discs.shape[1]):
        radius = discs[tile, j, 2]
        fx = discs[tile, j, 0] - x
        fy = discs[tile, j, 1] - y
        gap = math.sqrt(fx * fx + fy * fy) - radius if radius > ZERO else FAR
        clearance = min(clearance, gap)
        near[count] = j
        count += (gap < limit) & (cos_heading * fx + sin_heading * fy + radius >= back)
    for k in range(count):
        j = near[k]
        _shorten_by_circle(discs[tile, j, 0] - x, discs[tile, j, 1] - y, discs[tile, j, 2], limit, ranges, dx, dy)
    return clearance


@kernel(allocates=True)
def scan_poses(poses, maps, bounds, circles, boxes, ray_cos, ray_sin, limit, looks_ahead, ranges):
    """Fill `ranges` (n, rays) with the scans from `poses` (n, 3), each in the arena that `maps` (n,) names.

    `ray_cos` and `ray_sin` are (n, padded(rays)), or (1, padded(rays)) where all scanners are alike.
    """
    dx = np.empty(ray_cos.shape[1], np.float32)
    dy = np.empty(ray_cos.shape[1], np.float32)
    scan = np.empty(ray_cos.shape[1], np.float32)
    near = np.empty(max(circles.shape[1], boxes.shape[1]) + 1, np.int32)
    for i in range(poses.shape[0]):
        own = min(i, ray_cos.shape[0] - 1)
        sense(
            poses[i, 0], poses[i, 1], np.float32(math.cos(poses[i, 2])), np.float32(math.sin(poses[i, 2])), maps[i],
            bounds, circles, boxes, ray_cos[own], ray_sin[own], limit, looks_ahead, scan, dx, dy, near,
        )  # fmt: skip
        for k in range(ranges.shape[1]):
            ranges[i, k] = scan[k]


@kernel()
def clearance_points(points, maps, bounds, circles, boxes, result):
    """Fill `result` (n,) with the clearances of `points` (n, 2), each in the arena that `maps` (n,) names."""
    for i in range(points.shape[0]):
        result[i] = clearance_at(points[i, 0], points[i, 1], maps[i], bounds, circles, boxes)
