"""Where robots may start and targets may stand: the connected free space of an arena, as a list of square cells.

A grid of cells is kept rather than a bounding rectangle so that sampling stays quick and never picks a pocket that the robot
cannot leave, in a maze or an imported map as much as in an empty hall. A gap that is wider than the robot needs by less than
a cell may count as closed.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.arenas.cells import Grid, components, obstacle_distance
from sim.arenas.geometry import Arena
from sim.errors import ArenaError
from sim.kernels.records import CELL

MAX_CELLS = 4_000_000
"""Cells of the largest grid: 200 x 200 m."""

SPAWN_MARGIN = 0.2
"""Metres that starts and targets keep from obstacles beyond what a robot needs to pass: 0.4 m in all by default."""

_HALF_DIAGONAL = CELL * 0.5**0.5


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """Cells of one connected region; a point drawn in one of them needs only its exact clearance checked.

    Attributes:
        starts, targets: (n, 2) lower left corners of the cells, metres.
        clearance: metres that a start or target keeps from everything.
    """

    starts: NDArray[np.float32]
    targets: NDArray[np.float32]
    clearance: float


def grid_over(arena: Arena) -> Grid:
    """The cells that cover an arena.

    Raises:
        ArenaError: the arena needs more than `MAX_CELLS`.
    """
    columns = max(1, round(2.0 * arena.half_width / CELL))
    rows = max(1, round(2.0 * arena.half_height / CELL))
    if columns * rows > MAX_CELLS:
        raise ArenaError(f"arena {arena.name!r} is too large: at most {MAX_CELLS * CELL**2:,.0f} square metres")
    return Grid(rows, columns, CELL)


def largest_region(free: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The largest 4-connected region of a (rows, columns) mask; all False when nothing is free."""
    labels, _ = components(free, corners=False)
    return np.asarray(labels == 0)


def free_space(arena: Arena, *, passable: float, clearance: float) -> FreeSpace:
    """The cells in which robots start and targets stand.

    Args:
        arena: the place.
        passable: clearance that the robot needs on its way, metres; the region is connected at this clearance.
        clearance: clearance that starts and targets keep, metres, at least `passable`.

    Raises:
        ArenaError: nothing is left to start from or to drive to.
    """
    grid = grid_over(arena)
    x, y = np.meshgrid(grid.xs(), grid.ys())
    wall = np.minimum(arena.half_width - np.abs(x), arena.half_height - np.abs(y))
    distance = np.minimum(wall, obstacle_distance(arena, grid, clearance))
    # A cell counts when any point of it may have the clearance: the exact check is made on the point drawn.
    candidates = largest_region(distance >= passable) & (distance >= clearance - _HALF_DIAGONAL)
    cells = []
    for what, inset in (("start", arena.start_inset), ("target", arena.target_inset)):
        chosen = candidates & (wall > inset)
        if not (chosen & (distance >= clearance)).any():
            raise ArenaError(
                f"arena {arena.name!r} has no free space for a {what} with {clearance:.2f} m clearance; "
                "use a smaller robot or a more open arena"
            )
        cells.append((np.stack([x[chosen], y[chosen]], axis=-1) - 0.5 * CELL).astype(np.float32))
    return FreeSpace(starts=cells[0], targets=cells[1], clearance=clearance)
