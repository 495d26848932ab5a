"""A grid that is mapped while driving, and the shortest way in it: the inner loop of `sim.baselines.memory`.

What was never seen counts as free, so the way leads through it until it is seen.
"""

import heapq
import math

import numpy as np

from sim.baselines.kernels import kernel

HIT, MISS, SURE = 6, 1, 30
"""What one scan adds to a cell that it hits and takes from one that it sees through, and how sure a cell gets at most."""

OCCUPIED = 4
"""From this on a cell counts as occupied."""

_FAR = np.float32(1e6)
_DIAGONAL = math.sqrt(2.0)
_NEAR_COST = 3.0  # a cell that just keeps clear costs so many times as much more than one in the open


@kernel()
def trace(grid, origin_x, origin_y, cell, starts, heading, angles, ranges, limit):
    """Take one scan into a grid (rows, columns) int8 whose lower left corner is at the origin given, metres.

    Rays begin at `starts` (n, 2), metres; those that read the full range clear what they pass.
    """
    rows, columns = grid.shape
    for k in range(ranges.shape[0]):
        x = starts[k, 0]
        y = starts[k, 1]
        length = ranges[k]
        hit = length < limit
        ux = math.cos(heading + angles[k])
        uy = math.sin(heading + angles[k])
        steps = int(length / cell)
        last = -1
        for s in range(steps):
            at = (s + 0.5) * cell
            c = int((x + at * ux - origin_x) / cell)
            r = int((y + at * uy - origin_y) / cell)
            if r < 0 or c < 0 or r >= rows or c >= columns:
                hit = False
                break
            here = r * columns + c
            if here != last and at < length - cell:
                grid[r, c] = max(grid[r, c] - MISS, -SURE)
            last = here
        if hit:
            c = int((x + (length + 0.02) * ux - origin_x) / cell)
            r = int((y + (length + 0.02) * uy - origin_y) / cell)
            if 0 <= r < rows and 0 <= c < columns:
                grid[r, c] = min(grid[r, c] + HIT, SURE)


@kernel()
def distances(grid, cell, result):
    """Fill `result` (rows, columns) float32 with about the metres from each cell to the nearest occupied one (chamfer)."""
    rows, columns = grid.shape
    straight = np.float32(cell)
    slanted = np.float32(cell * _DIAGONAL)
    for r in range(rows):
        for c in range(columns):
            d = np.float32(0.0) if grid[r, c] >= OCCUPIED else _FAR
            if c > 0:
                d = min(d, result[r, c - 1] + straight)
            if r > 0:
                d = min(d, result[r - 1, c] + straight)
                if c > 0:
                    d = min(d, result[r - 1, c - 1] + slanted)
                if c + 1 < columns:
                    d = min(d, result[r - 1, c + 1] + slanted)
            result[r, c] = d
    for r in range(rows - 1, -1, -1):
        for c in range(columns - 1, -1, -1):
            d = result[r, c]
            if c + 1 < columns:
                d = min(d, result[r, c + 1] + straight)
            if r + 1 < rows:
                d = min(d, result[r + 1, c] + straight)
                if c + 1 < columns:
                    d = min(d, result[r + 1, c + 1] + slanted)
                if c > 0:
                    d = min(d, result[r + 1, c - 1] + slanted)
            result[r, c] = d


@kernel(allocates=True)
def plan(gaps, cell, keep, comfort, row, column, goal_row, goal_column, way):
    """A* from a cell to another over cells at least `keep` metres from what is occupied, cheaper from `comfort` on.

    Args:
        gaps: (rows, columns) of `distances`.
        cell: edge of a cell, metres.
        keep: metres; where the start keeps less, cells no nearer than it are allowed.
        comfort: metres.
        row: of the start.
        column: of the start.
        goal_row: of the goal, which counts as free.
        goal_column: of the goal.
        way: (n, 2) int32, written: cells from the start on.

    Returns:
        How many cells were written; 0 where there is no way.
    """
    rows, columns = gaps.shape
    least = min(keep, gaps[row, column])
    cost = np.full((rows, columns), np.inf, dtype=np.float32)
    parent = np.full((rows, columns), -1, dtype=np.int32)
    closed = np.zeros((rows, columns), dtype=np.bool_)
    cost[row, column] = 0.0
    queue = [(0.0, row * columns + column)]
    found = False
    while len(queue):
        _, here = heapq.heappop(queue)
        r = here // columns
        c = here % columns
        if closed[r, c]:
            continue
        closed[r, c] = True
        if r == goal_row and c == goal_column:
            found = True
            break
        for nr in range(max(r - 1, 0), min(r + 2, rows)):
            for nc in range(max(c - 1, 0), min(c + 2, columns)):
                if closed[nr, nc]:
                    continue
                at_goal = nr == goal_row and nc == goal_column
                gap = gaps[nr, nc]
                if not at_goal and (gap < least or (gap < keep and gap < gaps[r, c])):
                    continue
                near = max(0.0, (comfort - gap) / max(comfort - keep, 1e-6))
                step = (1.0 if nr == r or nc == c else _DIAGONAL) * (1.0 + _NEAR_COST * min(near, 1.0))
                through = cost[r, c] + step
                if through < cost[nr, nc]:
                    cost[nr, nc] = through
                    parent[nr, nc] = here
                    ahead = math.sqrt((nr - goal_row) ** 2 + (nc - goal_column) ** 2)
                    heapq.heappush(queue, (through + ahead, nr * columns + nc))
    if not found:
        return 0
    length = 0
    here = goal_row * columns + goal_column
    while here >= 0:
        length += 1
        here = parent[here // columns, here % columns]
    here = goal_row * columns + goal_column
    for k in range(length - 1, -1, -1):
        if k < way.shape[0]:
            way[k, 0] = here // columns
            way[k, 1] = here % columns
        here = parent[here // columns, here % columns]
    return min(length, way.shape[0])
