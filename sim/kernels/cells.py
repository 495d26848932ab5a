"""How far an arena's cells are from its obstacles, with the cells beside each obstacle looked at and no others.

As `sim.arenas.geometry` has it for points, bit for bit: maps are drawn by it, and a map must stay what it is.
"""

import math

from sim.kernels.options import kernel

_BEYOND_ROUNDING = 1.0 + 1e-9
"""Times a square that is so much larger than another one, their roots differ by more than roundings of metres."""

_WORTH_A_LOOK = 1e-3
"""Metres below which that does not hold."""


@kernel()
def span(centre, reach, cell, count):
    """The first of `count` rows or columns whose middle may lie within reach of a coordinate, and the one after the last."""
    # As far as there are any, before they are whole numbers: an obstacle may be larger than those can be.
    low = min(max((centre - reach) / cell + 0.5 * count - 0.5, 0.0), float(count))
    high = min(max((centre + reach) / cell + 0.5 * count + 0.5, 0.0), float(count))
    return math.floor(low), math.ceil(high)


@kernel()
def lower_to_circles(distance, xs, ys, cell, circles, cap):
    """Lower distances to those from circles, where they are less.

    Args:
        distance: (R, C) metres, at most `cap`.
        xs: (C,) middles of the columns, metres.
        ys: (R,) middles of the rows, metres.
        cell: edge of a cell, metres.
        circles: (N, 3) see `Arena.circles`.
        cap: metres.
    """
    for n in range(len(circles)):
        x, y, radius = circles[n, 0], circles[n, 1], circles[n, 2]
        first_row, last_row = span(y, radius + cap, cell, len(ys))
        first_column, last_column = span(x, radius + cap, cell, len(xs))
        for row in range(first_row, last_row):
            dy = ys[row] - y
            for column in range(first_column, last_column):
                dx = xs[column] - x
                known = distance[row, column] + radius
                if known > _WORTH_A_LOOK and dx * dx + dy * dy > known * known * _BEYOND_ROUNDING:
                    continue
                near = math.hypot(dx, dy) - radius
                if near < distance[row, column]:
                    distance[row, column] = near


@kernel()
def lower_to_boxes(distance, xs, ys, cell, boxes, turns, reaches):
    """Lower distances to those from boxes, where they are less.

    Args:
        distance: (R, C) metres.
        xs: (C,) middles of the columns, metres.
        ys: (R,) middles of the rows, metres.
        cell: edge of a cell, metres.
        boxes: (N, 5) see `Arena.boxes`.
        turns: (N, 2) cosine and sine of their angles.
        reaches: (N,) metres from their middles within which a distance may be lowered.
    """
    for n in range(len(boxes)):
        x, y, half_length, half_width = boxes[n, 0], boxes[n, 1], boxes[n, 2], boxes[n, 3]
        cos, sin = turns[n, 0], turns[n, 1]
        first_row, last_row = span(y, reaches[n], cell, len(ys))
        first_column, last_column = span(x, reaches[n], cell, len(xs))
        for row in range(first_row, last_row):
            dy = ys[row] - y
            for column in range(first_column, last_column):
                dx = xs[column] - x
                along = abs(cos * dx + sin * dy) - half_length
                across = abs(cos * dy - sin * dx) - half_width
                near = math.hypot(max(along, 0.0), max(across, 0.0)) + min(max(along, across), 0.0)
                if near < distance[row, column]:
                    distance[row, column] = near
