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

# Of two squared lengths that differ by less than this share, rounding may have swapped which is more.
_UNSURE = 1e-9


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
    free = inside_y[:, None] & inside_x[None, :]
    small = _are_small(arena.circles, grid, reach)
    _, taken = covered_cells(arena.circles[small], grid, clearance)
    free.reshape(-1)[taken] = False
    if len(arena.boxes) or not small.all():
        distance = np.full((grid.rows, grid.columns), reach, dtype=np.float64)
        _lower_to_large(distance, grid, arena.circles[~small], arena.boxes, reach)
        free &= distance >= reach
    return free


def covered_cells(circles: NDArray[np.float64], grid: Grid, clearance: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which circle takes which cells of `free_mask`.

    Returns:
        (P,) rows of `circles` and (P,) cells, counted row by row: a pair for each cell that a circle takes.
    """
    reach = _to_keep(clearance, grid.cell)
    pairs = []
    for rows, cells, across, along in _around(circles, grid, reach):
        radius = circles[rows, 2, None, None]
        limit = np.square(radius + reach)
        squares = np.square(across)[:, None, :] + np.square(along)[:, :, None]
        taken = squares < limit
        # Squares take a fifth of the time that lengths do; where they are so near to one another, lengths tell.
        unsure = np.abs(squares - limit) < _UNSURE * limit
        if unsure.any():
            exact = np.hypot(across[:, None, :], along[:, :, None]) - radius < reach
            taken[unsure] = exact[unsure]
        flat = taken.reshape(len(rows), -1)
        pairs.append((np.repeat(rows, np.count_nonzero(flat, axis=1)), cells[flat]))
    if not pairs:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    which, covered = (np.concatenate(part) for part in zip(*pairs, strict=True))
    return which, covered


def _to_keep(clearance: float, cell: float) -> float:
    """Metres that a cell's centre keeps where each of its points keeps `clearance`: it is so much to its corners."""
    return float(clearance + cell / np.sqrt(2.0))


def obstacle_distance(arena: Arena, grid: Grid, cap: float) -> NDArray[np.float64]:
    """(rows, columns) signed distances from the cells' centres to the nearest obstacle, but at most `cap` metres.

    Each obstacle costs only the cells within `cap` of it, where `free_distance`, the same bit for bit, costs all cells for
    all obstacles: seconds become minutes in a hall of 100 x 100 m with 2,000 obstacles.
    """
    distance = np.full((grid.rows, grid.columns), cap, dtype=np.float64)
    flat, small = distance.reshape(-1), _are_small(arena.circles, grid, cap)
    # Many at once: a thicket has hundreds of pillars.
    pillars = arena.circles[small]
    for rows, cells, across, along in _around(pillars, grid, cap):
        near = np.hypot(across[:, None, :], along[:, :, None]) - pillars[rows, 2, None, None]
        np.minimum.at(flat, cells.ravel(), near.ravel())
    _lower_to_large(distance, grid, arena.circles[~small], arena.boxes, cap)
    return distance


def _are_small(circles: NDArray[np.float64], grid: Grid, reach: float) -> NDArray[np.bool_]:
    """(C,) which circles reach few cells."""
    return np.asarray(circles[:, 2] + reach <= _SMALL * grid.cell)


def _lower_to_large(
    distance: NDArray[np.float64], grid: Grid, circles: NDArray[np.float64], boxes: NDArray[np.float64], cap: float
) -> None:
    """Lower distances to those from circles and boxes, one after the other."""
    xs, ys = grid.xs()[None, :], grid.ys()[:, None]
    for circle in circles:
        reach = circle[2] + cap
        rows, columns = grid.window(circle[0], circle[1], reach, reach)
        near = distance[rows, columns]
        np.minimum(near, circle_distance(circle, xs[:, columns], ys[rows]), out=near)
    for box in boxes:
        # As far as its corners reach along each axis: a long wall along one of them is near to few rows.
        cos, sin = abs(math.cos(box[4])), abs(math.sin(box[4]))
        rows, columns = grid.window(box[0], box[1], cos * box[2] + sin * box[3] + cap, sin * box[2] + cos * box[3] + cap)
        near = distance[rows, columns]
        np.minimum(near, box_distance(box, xs[:, columns], ys[rows]), out=near)


def _around(
    circles: NDArray[np.float64], grid: Grid, reach: float
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]]:
    """Some circles after others, and the cells around each, those within `reach` metres of it among them.

    Yields:
        (n,) rows of `circles`; (n, w * w) cells, counted row by row, those at the grid's edges several times; (n, w) metres
        from the circle's centre to the cells' centres along x, and as many along y.
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
            x, y, _ = np.split(circles[which], 3, axis=1)
            columns, rows = _indices(x, offsets, grid.cell, grid.columns), _indices(y, offsets, grid.cell, grid.rows)
            cells = rows[:, :, None] * grid.columns + columns[:, None, :]
            yield which, cells.reshape(len(which), -1), xs[columns] - x, ys[rows] - y


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
