"""Shortest paths to targets over an arena's free cells: straight where nothing is in the way, else from corner to corner.

Lazy Theta* (Nash, Koenig and Tovey, AAAI 2010) from the target, over all cells at once: each keeps the corner that its
path leads to first. Neighbours over a corner of two cells count, since a free cell is free to its corners.
"""

import heapq
import math

import numpy as np

from sim.kernels.options import kernel
from sim.kernels.records import CELL

ZERO = np.float32(0.0)

FAR_OFF = -1
"""In place of a corner: no path leads from here to the target."""

UNDERFOOT = 0.15
"""Metres within which a corner is as good as reached: it tells no direction any more."""


@kernel()
def _sees(free, row, column, to_row, to_column):
    """Whether every cell between the middles of two free cells is free."""
    rows = abs(to_row - row)
    columns = abs(to_column - column)
    down = 1 if to_row > row else -1
    right = 1 if to_column > column else -1
    ahead = columns - rows
    rows *= 2
    columns *= 2
    while row != to_row or column != to_column:
        if ahead > 0:
            column += right
            ahead -= rows
        elif ahead < 0:
            row += down
            ahead += columns
        else:
            row += down
            column += right
            ahead += columns - rows
        if not free[row, column]:
            return False
    return True


@kernel(allocates=True)
def lead(free, target, corners):
    """Write for each cell where the shortest path to a target leads first.

    Args:
        free: (rows, columns) bool.
        target: a free cell, row * columns + column.
        corners: (rows * columns or more,) int32, written: the cell at the next corner, the target itself where it is in
            sight, or `FAR_OFF`.
    """
    rows, columns = free.shape
    costs = np.full(rows * columns, np.inf, np.float32)
    settled = np.zeros(rows * columns, np.bool_)
    corners[: rows * columns] = FAR_OFF
    costs[target] = ZERO
    corners[target] = target
    queue = [(ZERO, target)]
    while len(queue) > 0:
        _, here = heapq.heappop(queue)
        if settled[here]:
            continue
        settled[here] = True
        row, column = here // columns, here % columns
        corner = np.int64(corners[here])
        if not _sees(free, row, column, corner // columns, corner % columns):
            # Its corner was thought to be in sight. It is not: go by the best neighbour that is settled.
            costs[here] = np.inf
            for r in range(max(row - 1, 0), min(row + 2, rows)):
                for c in range(max(column - 1, 0), min(column + 2, columns)):
                    cell = r * columns + c
                    if settled[cell] and cell != here:
                        dr, dc = r - row, c - column
                        cost = costs[cell] + np.float32(math.sqrt(dr * dr + dc * dc))
                        if cost < costs[here]:
                            costs[here] = cost
                            corners[here] = cell
            corner = np.int64(corners[here])
        corner_row, corner_column = corner // columns, corner % columns
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for c in range(max(column - 1, 0), min(column + 2, columns)):
                cell = r * columns + c
                if settled[cell] or not free[r, c]:
                    continue
                dr, dc = r - corner_row, c - corner_column
                cost = costs[corner] + np.float32(math.sqrt(dr * dr + dc * dc))
                if cost < costs[cell]:
                    costs[cell] = cost
                    corners[cell] = corner
                    heapq.heappush(queue, (cost, cell))


@kernel()
def _middle(cell, free):
    """X and y of a cell's middle, metres: the grid lies in the middle of its arena."""
    rows, columns = free.shape
    x = (cell % columns + 0.5 - 0.5 * columns) * CELL
    y = (cell // columns + 0.5 - 0.5 * rows) * CELL
    return x, y


@kernel()
def _cell_of(x, y, nearest):
    """The free cell at a point, metres, or the nearest one, given (rows, columns) those nearest to all cells."""
    rows, columns = nearest.shape
    row = min(max(math.floor(y / CELL + 0.5 * rows), 0), rows - 1)
    column = min(max(math.floor(x / CELL + 0.5 * columns), 0), columns - 1)
    return np.int64(nearest[row, column])


@kernel(allocates=True)
def grid_of(index, grids):
    """(rows, columns) free and nearest of an arena."""
    first, rows, columns = grids.places[index, 0], grids.places[index, 1], grids.places[index, 2]
    free = grids.free[first : first + rows * columns].reshape(rows, columns)
    return free, grids.nearest[first : first + rows * columns].reshape(rows, columns)


@kernel(allocates=True)
def shortest_way(x, y, target_x, target_y, index, slot, grids, fields, owners):
    """How far it is from a point to a target of an arena, and where to drive first.

    Args:
        x: of the point, metres, like the other three.
        y: likewise.
        target_x: of the target.
        target_y: likewise.
        index: of the arena.
        slot: the row of `fields` that may hold the target's; -1 is none.
        grids: `sim.engine.paths.Grids`.
        fields: (S, cells) int32, what `lead` wrote.
        owners: (S,) int64, of which arena's cell each is, counted through all arenas.

    Returns:
        The length, metres, below zero where the target's field is needed and is not in that row; x and y of the first corner
        that is not underfoot, or of the target; and the target's cell.
    """
    free, nearest = grid_of(index, grids)
    columns = free.shape[1]
    cell, target = _cell_of(x, y, nearest), _cell_of(target_x, target_y, nearest)
    straight = math.hypot(target_x - x, target_y - y)
    if _sees(free, cell // columns, cell % columns, target // columns, target % columns):
        return straight, target_x, target_y, target
    if slot < 0 or owners[slot] != grids.places[index, 0] + target:
        return -1.0, target_x, target_y, target
    corners = fields[slot]
    length = 0.0
    at_x, at_y, first_x, first_y, leads = x, y, target_x, target_y, False
    if corners[cell] != FAR_OFF:
        corner = np.int64(corners[cell])
        while corner != target:
            next_x, next_y = _middle(corner, free)
            if not leads and math.hypot(next_x - at_x, next_y - at_y) > UNDERFOOT:
                first_x, first_y, leads = next_x, next_y, True
            length += math.hypot(next_x - x, next_y - y)
            x, y = next_x, next_y
            corner = np.int64(corners[corner])
    return max(straight, length + math.hypot(target_x - x, target_y - y)), first_x, first_y, target


@kernel(allocates=True)
def find_ways(first, last, which, robots, slots, grids, fields, owners, lengths, firsts, missing):
    """Write how far some robots are from their targets, and where to drive first; others may be another thread's meanwhile.

    Args:
        first: of the robots that are looked at.
        last: the one after them.
        which: (N,) bool, which of these.
        robots: `sim.kernels.bundles.Robots`.
        slots: (N,) int32 rows of `fields` that may hold their targets'.
        grids: see `shortest_way`, like `fields` and `owners`.
        fields: likewise.
        owners: likewise.
        lengths: (N,) float64 metres, written but where a field is missing.
        firsts: (N, 2) float64 x, y, metres, likewise.
        missing: (N,) int32, written from `first` on: the robots for which it is.

    Returns:
        How many these are.
    """
    count = 0
    for i in range(first, last):
        if not which[i]:
            continue
        x, y = np.float64(robots.poses[i, 0]), np.float64(robots.poses[i, 1])
        target_x, target_y = np.float64(robots.targets[i, 0]), np.float64(robots.targets[i, 1])
        length, first_x, first_y, _ = shortest_way(
            x, y, target_x, target_y, robots.records[i].map, slots[i], grids, fields, owners
        )
        if length < 0.0:
            missing[first + count] = i
            count += 1
            continue
        lengths[i] = length
        firsts[i, 0] = first_x
        firsts[i, 1] = first_y
    return count


@kernel()
def guide(which, robots, lengths, firsts, step_limit, numbers):
    """Write what the shortest paths tell of some robots, see `sim.engine.guidance`.

    Args:
        which: (N,) bool, which of them.
        robots: `sim.kernels.bundles.Robots`.
        lengths: what `find_ways` wrote, like `firsts`.
        firsts: likewise.
        step_limit: steps of an attempt.
        numbers: (N, 5) float32, written.
    """
    for i in range(which.shape[0]):
        if not which[i]:
            continue
        length = lengths[i]
        ahead, aside = firsts[i, 0] - np.float64(robots.poses[i, 0]), firsts[i, 1] - np.float64(robots.poses[i, 1])
        bearing = math.atan2(aside, ahead) - robots.poses[i, 2]
        numbers[i, 0] = length / (length + 5.0)
        numbers[i, 1] = length / 20.0
        numbers[i, 2] = math.sin(bearing)
        numbers[i, 3] = math.cos(bearing)
        # Where an attempt ended, the next one has begun, whose steps are counted from the next step on.
        numbers[i, 4] = 0.0 if robots.outcomes[i] else robots.records[i].steps / step_limit
