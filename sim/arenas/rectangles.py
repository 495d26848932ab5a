"""Cells into few rectangles: how occupied cells of a map, or a pocket nobody can leave, become boxes."""

import numpy as np
from numpy.typing import NDArray

from sim.arenas.cells import Mask


def cover(required: Mask, allowed: Mask, limit: int) -> NDArray[np.int64]:
    """Rectangles that cover every required cell and touch no cell that is not allowed; greedy, row by row.

    From the first cell that is not covered yet a rectangle grows to the right, then upwards, as far as allowed; then the
    same the other way about, and the one that covers more is taken. Rectangles may overlap.

    Args:
        required: (rows, columns) what must be covered; a part of `allowed`.
        allowed: (rows, columns) what may be covered.
        limit: stop after so many; one more than `limit` rectangles come back where they were not enough.

    Returns:
        (n, 4) first row, first column, row after the last, column after the last.
    """
    waiting = required.copy()
    found: list[tuple[int, int, int, int]] = []
    for row in range(len(waiting)):
        while waiting[row].any() and len(found) <= limit:
            column = int(waiting[row].argmax())
            right = column + _leading(allowed[row, column:])
            up = row + _leading(np.asarray(allowed[row:, column:right].all(axis=1)))
            tall = row + _leading(allowed[row:, column])
            wide = column + _leading(np.asarray(allowed[row:tall, column:].all(axis=0)))
            flat, high = (row, column, up, right), (row, column, tall, wide)
            best = max(flat, high, key=lambda box: int(waiting[box[0] : box[2], box[1] : box[3]].sum()))
            waiting[best[0] : best[2], best[1] : best[3]] = False
            found.append(best)
    return np.array(found, dtype=np.int64).reshape(-1, 4)


def _leading(cells: Mask) -> int:
    """How many cells from the first on are true."""
    return len(cells) if bool(cells.all()) else int(cells.argmin())


def to_boxes(rectangles: NDArray[np.int64], x: float, y: float, cell: float) -> NDArray[np.float64]:
    """Rectangles of cells as boxes.

    Args:
        rectangles: (n, 4) as `cover` returns them.
        x: where row 0, column 0 begins at its left, metres.
        y: where it begins at its bottom, metres.
        cell: edge of a cell, metres.

    Returns:
        (n, 5) x, y, half length, half width, angle (0).
    """
    low_y, low_x, high_y, high_x = (rectangles * cell).T
    return np.stack(
        [
            x + 0.5 * (low_x + high_x),
            y + 0.5 * (low_y + high_y),
            0.5 * (high_x - low_x),
            0.5 * (high_y - low_y),
            np.zeros(len(rectangles)),
        ],
        axis=1,
    )
