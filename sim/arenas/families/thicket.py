"""Thickets of thin pillars, drawn as the worlds of the BARN benchmark are: clumps, bays and dead ends."""

import numpy as np
from numpy.typing import NDArray

from sim.arenas.cells import CELL, Grid, Mask, components, covered_cells, free_mask
from sim.arenas.families.layout import Plan
from sim.arenas.geometry import Arena

# Thickness of a pillar, metres, and as a share of the robot's own space around its centre where that is more: BARN's 0.15 m
# stand on 20 square metres, these on 100.
_PILLAR = 0.2
_PILLAR_SHARE = 0.8
# Share of the cells that hold a pillar before smoothing, from easy to hard; BARN has 0.15 to 0.30.
_FILL = (0.10, 0.24)
# Rounds of smoothing, as BARN's: a cell with more neighbours than the first is filled in each, one with fewer than the
# second is emptied.
_ROUNDS = (2, 3, 4)
_CROWDED, _LONELY = 4, 2
# Pockets are opened until less than this share of the free floor is in them, or as often as this.
_POCKETS = 0.015
_OPENINGS = 40
# How much wider than the robot's own space an opening is, metres.
_SPARE = 0.2


def thicket(plan: Plan) -> None:
    """Fill the plan: a cellular automaton over square cells (Perille et al. 2020), then a way into every large pocket."""
    random = plan.random
    cell = max(_PILLAR, _PILLAR_SHARE * plan.clearance)
    side = int(plan.size / cell)
    rounds = int(random.choice(_ROUNDS))
    filled = random.random((side, side)) < plan.between(*_FILL)
    for _ in range(rounds):
        filled = _smoothed(filled)
    rows, columns = np.nonzero(filled)
    centres = (np.stack([columns, rows], axis=1) + 0.5 - 0.5 * side) * cell
    pillars = np.column_stack([centres, np.full(len(centres), 0.5 * cell)])
    empty = Arena("thicket", plan.half, plan.half)
    floor, grid = free_mask(empty, plan.clearance, CELL), Grid.over(empty)
    # Which pillar takes which cells does not change as others are taken away.
    which, cells = covered_cells(pillars, grid, plan.clearance)
    for _ in range(_OPENINGS):
        free = floor.copy()
        free.reshape(-1)[cells] = False
        opening = _missing_way(free, grid)
        if opening is None:
            break
        keep = plan.clearance + 0.5 * _SPARE
        stays = _distance_to_segment(pillars[:, :2], *opening) - pillars[:, 2] >= keep
        left = stays[which]
        which, cells = (np.cumsum(stays) - 1)[which[left]], cells[left]
        pillars = pillars[stays]
    plan.circles.extend((x, y, radius) for x, y, radius in pillars.tolist())


def _smoothed(filled: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The next round of the automaton; what lies outside counts as filled."""
    rows, columns = filled.shape
    around = np.pad(filled, 1, constant_values=True).astype(np.int8)
    neighbours = -around[1:-1, 1:-1]
    for row in range(3):
        for column in range(3):
            neighbours = neighbours + around[row : row + rows, column : column + columns]
    return np.asarray((filled | (neighbours > _CROWDED)) & (neighbours >= _LONELY))


def _missing_way(free: Mask, grid: Grid) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Where the largest pocket and the largest open part come nearest to one another; None where no pocket matters."""
    labels, sizes = components(free)
    if len(sizes) < 2 or sizes[1:].sum() <= _POCKETS * sizes.sum():
        return None
    # The nearest two points lie on edges, and all pairs of all cells would take a hundred times as long.
    inner = np.pad(labels >= 0, 1)
    edge = ~(inner[:-2, 1:-1] & inner[2:, 1:-1] & inner[1:-1, :-2] & inner[1:-1, 2:])
    pocket, open_part = (
        np.stack([grid.xs()[columns], grid.ys()[rows]], axis=1)
        for rows, columns in (np.nonzero(edge & (labels == label)) for label in (1, 0))
    )
    squares = np.square(np.subtract.outer(pocket[:, 0], open_part[:, 0]))
    squares += np.square(np.subtract.outer(pocket[:, 1], open_part[:, 1]))
    here, there = np.unravel_index(int(squares.argmin()), squares.shape)
    return pocket[here], open_part[there]


def _distance_to_segment(
    points: NDArray[np.float64], begin: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n,) metres from points (n, 2)."""
    along = end - begin
    share = np.clip((points - begin) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
    return np.asarray(np.hypot(*(points - begin - share[:, None] * along).T), dtype=np.float64)
