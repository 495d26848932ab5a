"""Where a robot fits: an arena as a grid of free cells, and which of them hang together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.arenas.geometry import Arena
from sim.kernels.cells import lower_to_boxes, lower_to_circles, span

Mask = NDArray[np.bool_]
Labels = NDArray[np.int32]

# Edge of a cell, metres. Passages that are wider than a robot's own space by less than 2.5 cells may be missed.
CELL = 0.05


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

    def window(self, x: float, y: float, reach: float) -> tuple[slice, slice]:
        """The rows and columns whose centres may lie within `reach` of a point."""
        rows, columns = span(y, reach, self.cell, self.rows), span(x, reach, self.cell, self.columns)
        return slice(*rows), slice(*columns)


def free_mask(arena: Arena, clearance: float, cell: float = CELL) -> Mask:
    """(rows, columns) whether every point of a cell keeps `clearance` from walls and obstacles.

    So a path through free cells, also from corner to corner, keeps the clearance all the way.
    """
    grid = Grid.over(arena, cell)
    reach = clearance + cell / np.sqrt(2.0)  # from a cell's centre to its corner
    xs, ys = grid.xs(), grid.ys()
    inside_x = arena.half_width - np.abs(xs) >= clearance + 0.5 * cell - 1e-9
    inside_y = arena.half_height - np.abs(ys) >= clearance + 0.5 * cell - 1e-9
    inside = inside_y[:, None] & inside_x[None, :]
    return np.asarray(inside & (obstacle_distance(arena, grid, reach) >= reach))


def obstacle_distance(arena: Arena, grid: Grid, cap: float) -> NDArray[np.float64]:
    """(rows, columns) signed distances from the cells' centres to the nearest obstacle, but at most `cap` metres.

    Each obstacle costs only the cells within `cap` of it, where `free_distance`, the same bit for bit, costs all cells for
    all obstacles: seconds become minutes in a hall of 100 x 100 m with 2,000 obstacles.
    """
    xs, ys = grid.xs(), grid.ys()
    distance = np.full((grid.rows, grid.columns), cap, dtype=np.float64)
    lower_to_circles(distance, xs, ys, grid.cell, arena.circles, cap)
    boxes = arena.boxes
    turns = np.stack([np.cos(boxes[:, 4]), np.sin(boxes[:, 4])], axis=1)
    lower_to_boxes(distance, xs, ys, grid.cell, boxes, turns, np.hypot(boxes[:, 2], boxes[:, 3]) + cap)
    return distance


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
