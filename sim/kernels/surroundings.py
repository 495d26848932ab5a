"""What walls and obstacles leave to a mover: half-planes of velocities, and how far a direction is free.

All is float64 with none but those floating-point freedoms that change no result, unlike what robots sense
(`sim.kernels.sensing`): the same scene shall move in the same way on every machine.
"""

import math

import numpy as np

from sim.kernels.options import kernel

EXACT = {"nnan", "ninf", "nsz"}
"""Floating-point freedoms that change no result."""

SKIN = 0.005
"""Metres that movers keep from obstacles and from one another."""

_TINY = 1e-12  # keeps divisions by a direction finite
_DIAGONAL = 1.4143  # of a unit square, and a little more


@kernel(fastmath=EXACT)
def gap(x, y, index, bounds, circles, boxes):
    """Signed distance from a point to the nearest surface of arena `index`, metres: the same on every machine."""
    distance = min(bounds[index, 0] - abs(x), bounds[index, 1] - abs(y))
    for j in range(circles.shape[1]):
        radius = np.float64(circles[index, j, 2])
        if radius > 0.0:
            fx = circles[index, j, 0] - x
            fy = circles[index, j, 1] - y
            distance = min(distance, math.sqrt(fx * fx + fy * fy) - radius)
    for j in range(boxes.shape[1]):
        if boxes[index, j, 2] > 0.0:
            gx = x - boxes[index, j, 0]
            gy = y - boxes[index, j, 1]
            cos = np.float64(boxes[index, j, 4])
            sin = np.float64(boxes[index, j, 5])
            along = abs(cos * gx + sin * gy) - boxes[index, j, 2]
            across = abs(cos * gy - sin * gx) - boxes[index, j, 3]
            px = max(along, 0.0)
            py = max(across, 0.0)
            distance = min(distance, math.sqrt(px * px + py * py) + min(max(along, across), 0.0))
    return distance


@kernel(fastmath=EXACT, inline="always")
def _within(x, y, reach, index, hulls, near):
    """List in `near` the obstacles of arena `index` whose hulls are nearer than `reach`; returns how many."""
    count = 0
    for j in range(hulls.shape[2]):
        fx = hulls[index, 0, j] - x
        fy = hulls[index, 1, j] - y
        far = hulls[index, 2, j] + reach
        near[count] = j
        count += fx * fx + fy * fy < far * far
    return count


@kernel(fastmath=EXACT, inline="always")
def _in_the_way(x, y, dx, dy, length, margin, index, hulls, near):
    """The same for those whose hulls come nearer than `margin` to the first `length` metres in direction (dx, dy)."""
    count = 0
    for j in range(hulls.shape[2]):
        fx = hulls[index, 0, j] - x
        fy = hulls[index, 1, j] - y
        far = hulls[index, 2, j] + margin
        ahead = fx * dx + fy * dy
        near[count] = j
        count += (abs(fx * dy - fy * dx) < far) & (ahead > -far) & (ahead - far < length)
    return count


@kernel(fastmath=EXACT, inline="always")
def obstacle_lines(x, y, radius, reach, interval, index, bounds, circles, boxes, hulls, near, lines):
    """Write the half-planes that obstacles nearer than `reach` leave to a disc; returns how many.

    `interval` is the time for which they hold, seconds; `near` is scratch, as long as there are hulls.
    """
    n = 0
    for axis in range(2):
        place = y if axis else x
        half = bounds[index, axis] - radius - SKIN
        if half - abs(place) >= reach:
            continue
        for sign in (-1.0, 1.0):
            lines[n, axis] = sign
            lines[n, 1 - axis] = 0.0
            lines[n, 2] = max(half - sign * place, 0.0) / interval
            n += 1
    keep = radius + SKIN
    for k in range(_within(x, y, keep + reach, index, hulls, near)):
        j = near[k]
        if j < circles.shape[1]:
            size = np.float64(circles[index, j, 2])
            fx = circles[index, j, 0] - x
            fy = circles[index, j, 1] - y
            squared = fx * fx + fy * fy
            far = size + keep + reach
            if squared >= far * far:
                continue
            distance = max(math.sqrt(squared), 1e-9)
            lines[n, 0] = fx / distance
            lines[n, 1] = fy / distance
            lines[n, 2] = max(distance - size - keep, 0.0) / interval
            n += 1
            continue
        j -= circles.shape[1]
        gx = x - boxes[index, j, 0]
        gy = y - boxes[index, j, 1]
        cos = np.float64(boxes[index, j, 4])
        sin = np.float64(boxes[index, j, 5])
        lx = cos * gx + sin * gy
        ly = cos * gy - sin * gx
        along = abs(lx) - boxes[index, j, 2]
        across = abs(ly) - boxes[index, j, 3]
        px = max(along, 0.0)
        py = max(across, 0.0)
        squared = px * px + py * py
        far = keep + reach
        if squared >= far * far:
            continue
        distance = math.sqrt(squared)
        if distance > 0.0:
            ux = -math.copysign(px, lx) / distance
            uy = -math.copysign(py, ly) / distance
        else:  # its centre is in the box: nothing but a way out
            ux = -math.copysign(1.0, lx) if along > across else 0.0
            uy = 0.0 if along > across else -math.copysign(1.0, ly)
        lines[n, 0] = cos * ux - sin * uy
        lines[n, 1] = sin * ux + cos * uy
        lines[n, 2] = max(distance - keep, 0.0) / interval
        n += 1
    return n


@kernel(fastmath=EXACT, inline="always")
def free_length(x, y, dx, dy, keep, index, bounds, circles, boxes, hulls, near):
    """Metres that a disc which needs `keep` around its centre can go in direction (dx, dy); boxes count with square corners.

    Where it is too near to something already, it may go away from it. `near` is scratch, as long as there are hulls.
    """
    to_side = (bounds[index, 0] - keep - (x if dx > 0.0 else -x)) / max(abs(dx), _TINY)
    to_end = (bounds[index, 1] - keep - (y if dy > 0.0 else -y)) / max(abs(dy), _TINY)
    length = max(min(to_side, to_end), 0.0)
    for k in range(_in_the_way(x, y, dx, dy, length, _DIAGONAL * keep, index, hulls, near)):
        j = near[k]
        if j < circles.shape[1]:
            fx = circles[index, j, 0] - x
            fy = circles[index, j, 1] - y
            ahead = fx * dx + fy * dy
            aside = fx * dy - fy * dx
            far = circles[index, j, 2] + keep
            square = far * far - aside * aside
            if square > 0.0 and ahead > 0.0:
                length = min(length, max(ahead - math.sqrt(square), 0.0))
            continue
        j -= circles.shape[1]
        half_length = boxes[index, j, 2] + keep
        half_width = boxes[index, j, 3] + keep
        gx = x - boxes[index, j, 0]
        gy = y - boxes[index, j, 1]
        cos = np.float64(boxes[index, j, 4])
        sin = np.float64(boxes[index, j, 5])
        lx = cos * gx + sin * gy
        ly = cos * gy - sin * gx
        ux = cos * dx + sin * dy
        uy = cos * dy - sin * dx
        ix = 1.0 / (ux if abs(ux) > _TINY else _TINY)
        iy = 1.0 / (uy if abs(uy) > _TINY else _TINY)
        enter = max(-lx * ix - abs(ix) * half_length, -ly * iy - abs(iy) * half_width)
        leave = min(-lx * ix + abs(ix) * half_length, -ly * iy + abs(iy) * half_width)
        if leave <= max(enter, 0.0):
            continue
        if enter < 0.0:
            beside = abs(lx) - half_length > abs(ly) - half_width
            if (lx * ux if beside else ly * uy) >= 0.0:
                continue
        length = min(length, max(enter, 0.0))
    return length
