"""Clearance of a rectangular body against walls, circles and oriented boxes, for one robot at a time.

`sim.engine.footprint` is the same written plainly; tests/sim/test_robots.py holds both against Chipmunk's shape queries.
"""

import math

import numpy as np

from sim.kernels.observing import wrapped
from sim.kernels.options import kernel
from sim.kernels.sensing import FAST

ZERO = np.float32(0.0)

PASSING_SAMPLES = 16
"""Points of a step at which a mover's distance from a rectangular body is looked at: at 1.5 m/s they are 2 cm apart."""


@kernel(fastmath=FAST)
def from_rectangle(along, across, half_length, half_width):
    """Signed distance from a rectangle to a point in its frame, metres: negative inside."""
    beyond = abs(along) - half_length
    beside = abs(across) - half_width
    px = max(beyond, ZERO)
    py = max(beside, ZERO)
    return math.sqrt(px * px + py * py) + min(max(beyond, beside), ZERO)


@kernel(fastmath=FAST)
def _nearest_corner(x, y, cos, sin, length, width, half_length, half_width):
    """Distance from a rectangle to the nearest corner of one with half extents `length`, `width` at x, y in its frame."""
    ax = cos * length
    ay = sin * length
    bx = -sin * width
    by = cos * width
    nearest = from_rectangle(x + ax + bx, y + ay + by, half_length, half_width)
    nearest = min(nearest, from_rectangle(x + ax - bx, y + ay - by, half_length, half_width))
    nearest = min(nearest, from_rectangle(x - ax + bx, y - ay + by, half_length, half_width))
    return min(nearest, from_rectangle(x - ax - bx, y - ay - by, half_length, half_width))


@kernel(fastmath=FAST)
def _between(x, y, cos, sin, length, width, half_length, half_width):
    """Signed distance between a rectangle and another at x, y in its frame, turned by (cos, sin): `sim.engine.footprint`."""
    c = abs(cos)
    s = abs(sin)
    # The first one's middle in the other's frame.
    u = cos * x + sin * y
    v = cos * y - sin * x
    gap = max(
        max(abs(x) - half_length - (c * length + s * width), abs(y) - half_width - (s * length + c * width)),
        max(abs(u) - length - (c * half_length + s * half_width), abs(v) - width - (s * half_length + c * half_width)),
    )
    if gap <= ZERO:
        return gap
    return min(
        _nearest_corner(x, y, cos, sin, length, width, half_length, half_width),
        _nearest_corner(-u, -v, cos, -sin, half_length, half_width, length, width),
    )


@kernel(fastmath=FAST)
def rectangle_clearance(x, y, heading, index, bounds, circles, boxes, length, width):
    """Signed distance from a body of half extents `length` and `width` at a pose to the nearest surface, metres."""
    cos = np.float32(math.cos(heading))
    sin = np.float32(math.sin(heading))
    reach = math.sqrt(length * length + width * width)
    clearance = min(
        bounds[index, 0] - abs(x) - (abs(cos) * length + abs(sin) * width),
        bounds[index, 1] - abs(y) - (abs(sin) * length + abs(cos) * width),
    )
    for j in range(circles.shape[1]):
        radius = circles[index, j, 2]
        if radius <= ZERO:
            continue
        fx = circles[index, j, 0] - x
        fy = circles[index, j, 1] - y
        if math.sqrt(fx * fx + fy * fy) - radius - reach >= clearance:
            continue
        clearance = min(clearance, from_rectangle(cos * fx + sin * fy, cos * fy - sin * fx, length, width) - radius)
    for j in range(boxes.shape[1]):
        half_length = boxes[index, j, 2]
        if half_length <= ZERO:
            continue
        half_width = boxes[index, j, 3]
        box_cos = boxes[index, j, 4]
        box_sin = boxes[index, j, 5]
        gx = x - boxes[index, j, 0]
        gy = y - boxes[index, j, 1]
        lx = box_cos * gx + box_sin * gy
        ly = box_cos * gy - box_sin * gx
        if from_rectangle(lx, ly, half_length, half_width) - reach >= clearance:
            continue
        turned_cos = cos * box_cos + sin * box_sin
        turned_sin = sin * box_cos - cos * box_sin
        clearance = min(clearance, _between(lx, ly, turned_cos, turned_sin, length, width, half_length, half_width))
    return clearance


@kernel(fastmath=FAST)
def swept_rectangle_clearance(x, y, heading, dx, dy, tile, discs, closing, length, width, clearance):
    """`clearance` or, where it is smaller, that of a body from a tile's movers, metres.

    It is the smallest while the body came to its pose by (dx, dy) and each mover by its last step, both straight and
    together by at most `closing`.
    """
    cos = np.float32(math.cos(heading))
    sin = np.float32(math.sin(heading))
    reach = math.sqrt(length * length + width * width) + closing
    for j in range(discs.shape[1]):
        radius = discs[tile, j, 2]
        if radius <= ZERO:
            continue
        fx = discs[tile, j, 0] - x
        fy = discs[tile, j, 1] - y
        if math.sqrt(fx * fx + fy * fy) - radius - reach >= clearance:
            continue
        sx = (discs[tile, j, 3] - dx) / np.float32(PASSING_SAMPLES)
        sy = (discs[tile, j, 4] - dy) / np.float32(PASSING_SAMPLES)
        for _ in range(PASSING_SAMPLES):
            clearance = min(clearance, from_rectangle(cos * fx + sin * fy, cos * fy - sin * fx, length, width) - radius)
            fx -= sx
            fy -= sy
    return clearance


@kernel(fastmath=FAST)
def moving_rectangle_clearance(
    last_x, last_y, last_heading, x, y, heading, index, bounds, circles, boxes, length, width, samples
):
    """Smallest clearance of a body on its way to (x, y, heading), looked at `samples` times, metres."""
    turn = wrapped(heading - last_heading)
    clearance = rectangle_clearance(x, y, heading, index, bounds, circles, boxes, length, width)
    for k in range(1, samples):
        part = np.float32(k) / np.float32(samples)
        px = last_x + part * (x - last_x)
        py = last_y + part * (y - last_y)
        here = rectangle_clearance(px, py, last_heading + part * turn, index, bounds, circles, boxes, length, width)
        clearance = min(clearance, here)
    return clearance


@kernel()
def rectangle_clearances(poses, maps, bounds, circles, boxes, length, width, result):
    """Fill `result` (n,) with the clearances of a body at `poses` (n, 3), each in the arena that `maps` (n,) names."""
    for i in range(poses.shape[0]):
        result[i] = rectangle_clearance(
            poses[i, 0], poses[i, 1], poses[i, 2], maps[i], bounds, circles, boxes, length, width
        )  # fmt: skip
