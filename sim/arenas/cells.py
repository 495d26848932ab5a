"""Where a robot fits: an arena as a grid of free cells, and which of them hang together."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.arenas.geometry import Arena, box_distance, circle_distance

Mask = NDArray[np.bool_]
Labels = NDArray[np.int32]

# Edge of a cell, metres. Passages that are wider than a robot's own space by less than 2.5 cells may be missed.
CELL = 0.05

# Circles that reach no further than this many cells are looked at together, as many at once as have this many cells.
_SMALL = 10
_TOGETHER = 1 << 16


@dataclass(frozen=True, eq=False)
class Grid:
    """Square cells over an arena, centred as it is; row 0 is the lowest y, column 0 the lowest x."""

    rows: int
    columns: int
    cell: float

    @classmethod
    def over(cls, arena: Arena, cell: float = CELL) -> "Grid":
        """As many whole cells as fit between the arena's walls."""
        # A wall that stands on a cell's edge must not lose that cell to rounding.
        fit = (int(2.0 * half / cell + 1e-9) for half in (arena.half_height, arena.half_width))
        rows, columns = fit
        return cls(max(rows, 1), max(columns, 1), cell)

    def xs(self) -> NDArray[np.float64]:
        """(columns,) x of the cells' centres, metres."""
        return np.asarray((np.arange(self.columns) + 0.5 - 0.5 * self.columns) * self.cell, dtype=np.float64)

    def ys(self) -> NDArray[np.float64]:
        """(rows,) y of the cells' centres, metres."""
        return np.asarray((np.arange(self.rows) + 0.5 - 0.5 * self.rows) * self.cell, dtype=np.float64)

    def window(self, x: float, y: float, reach_x: float, reach_y: float) -> tuple[slice, slice]:
        """The rows and columns whose centres may lie within these reaches of a point, along x and along y."""
        return self._span(y, reach_y, self.rows), self._span(x, reach_x, self.columns)

    def _span(self, centre: float, reach: float, count: int) -> slice:
        # As far as there are any, before they are whole numbers: an obstacle may be larger than those can be.
        low = min(max((centre - reach) / self.cell + 0.5 * count - 0.5, 0.0), float(count))
        high = min(max((centre + reach) / self.cell + 0.5 * count + 0.5, 0.0), float(count))
        return slice(math.floor(low), math.ceil(high))


def free_mask(arena: Arena, clearance: float, cell: float = CELL) -> Mask:
    """(rows, columns) whether every point of a cell keeps `clearance` from walls and obstacles.

    So a path through free cells, also from corner to corner, keeps the clearance all the way.
    """
    grid = Grid.over(arena, cell)
    reach = _to_keep(clearance, cell)
    xs, ys = grid.xs(), grid.ys()
    inside_x = arena.half_width - np.abs(xs) >= clearance + 0.5 * cell - 1e-9
    inside_y = arena.half_height - np.abs(ys) >= clearance + 0.5 * cell - 1e-9
    inside = inside_y[:, None] & inside_x[None, :]
    return np.asarray(inside & (obstacle_distance(arena, grid, reach) >= reach))


def covered_cells(circles: NDArray[np.float64], grid: Grid, clearance: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which circle takes which cells of `free_mask`.

    Returns:
        (P,) rows of `circles` and (P,) cells, counted row by row: a pair for each cell that a circle takes.
    """
    reach = _to_keep(clearance, grid.cell)
    pairs = []
    for rows, cells, near in _around(circles, grid, reach):
        taken = near < reach
        pairs.append((np.repeat(rows, np.count_nonzero(taken, axis=1)), cells[taken]))
    if not pairs:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    which, cells = (np.concatenate(part) for part in zip(*pairs, strict=True))
    return which, cells


def _to_keep(clearance: float, cell: float) -> float:
    """Metres that a cell's centre keeps where each of its points keeps `clearance`: it is so much to its corners."""
    return float(clearance + cell / np.sqrt(2.0))


def obstacle_distance(arena: Arena, grid: Grid, cap: float) -> NDArray[np.float64]:
    """(rows, columns) signed distances from the cells' centres to the nearest obstacle, but at most `cap` metres.

    Each obstacle costs only the cells within `cap` of it, where `free_distance`, the same bit for bit, costs all cells for
    all obstacles: seconds become minutes in a hall of 100 x 100 m with 2,000 obstacles.
    """
    distance = np.full((grid.rows, grid.columns), cap, dtype=np.float64)
    circles = arena.circles
    small = circles[:, 2] + cap <= _SMALL * grid.cell
    flat = distance.reshape(-1)
    # Many at once: a thicket has hundreds of pillars.
    for _, cells, near in _around(circles[small], grid, cap):
        np.minimum.at(flat, cells.ravel(), near.ravel())
    xs, ys = grid.xs()[None, :], grid.ys()[:, None]
    for circle in circles[~small]:
        reach = circle[2] + cap
        rows, columns = grid.window(circle[0], circle[1], reach, reach)
        distance[rows, columns] = np.minimum(distance[rows, columns], circle_distance(circle, xs[:, columns], ys[rows]))
    for box in arena.boxes:
        # As far as its corners reach along each axis: a long wall along one of them is near to few rows.
        cos, sin = abs(math.cos(box[4])), abs(math.sin(box[4]))
        rows, columns = grid.window(box[0], box[1], cos * box[2] + sin * box[3] + cap, sin * box[2] + cos * box[3] + cap)
        distance[rows, columns] = np.minimum(distance[rows, columns], box_distance(box, xs[:, columns], ys[rows]))
    return distance


def _around(
    circles: NDArray[np.float64], grid: Grid, reach: float
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]]:
    """Some circles after others, the cells around each, those within `reach` metres of it among them, and how far these are.

    Yields:
        (n,) rows of `circles`; (n, w) cells, counted row by row, those at the grid's edges several times; (n, w) metres from
        the cells' centres to the circle.
    """
    # From the middle of the cell that a circle's centre lies in, half a cell away at most.
    widths = np.ceil((circles[:, 2] + reach) / grid.cell + 0.5).astype(np.int64)
    xs, ys = grid.xs(), grid.ys()
    for width in np.unique(widths):
        alike = np.flatnonzero(widths == width)
        offsets = np.arange(-width, width + 1)
        together = max(_TOGETHER // len(offsets) ** 2, 1)
        for first in range(0, len(alike), together):
            which = alike[first : first + together]
            x, y, radius = np.split(circles[which], 3, axis=1)
            columns, rows = _indices(x, offsets, grid.cell, grid.columns), _indices(y, offsets, grid.cell, grid.rows)
            near = np.hypot((xs[columns] - x)[:, None, :], (ys[rows] - y)[:, :, None]) - radius[:, :, None]
            cells = rows[:, :, None] * grid.columns + columns[:, None, :]
            yield which, cells.reshape(len(which), -1), near.reshape(len(which), -1)


def _indices(centres: NDArray[np.float64], offsets: NDArray[np.int64], cell: float, count: int) -> NDArray[np.int64]:
    """(N, W) the rows or columns around each of N coordinates, those beyond the last ones being the last ones."""
    reach = offsets[-1] + 1
    middles = np.clip(np.floor(centres / cell + 0.5 * count), -reach, count + reach).astype(np.int64)
    return np.asarray(np.clip(middles + offsets, 0, count - 1), dtype=np.int64)


def components(free: Mask, *, corners: bool = True) -> tuple[Labels, NDArray[np.int64]]:
    """Free cells that hang together, over edges and, unless `corners` is false, over corners.

    Returns:
        (rows, columns) labels, -1 where blocked, 0 for the largest component, the others by size; and (K,) their sizes in
        cells.
    """
    from scipy.ndimage import generate_binary_structure, label

    found, count = label(free, generate_binary_structure(2, 2 if corners else 1))
    sizes = np.bincount(found.ravel(), minlength=count + 1)[1:].astype(np.int64)
    last = np.zeros(count + 1, dtype=np.int64)
    last[found.ravel()] = np.arange(found.size)
    # Of two that are equally large, the one that ends first in row-major order comes first: families draw in that order.
    order = np.lexsort((last[1:], -sizes))
    rank = np.full(count + 1, -1, dtype=np.int32)
    rank[1 + order] = np.arange(count)
    return rank[found], sizes[order]
