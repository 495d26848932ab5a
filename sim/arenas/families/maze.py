"""A maze: one way between any two places at full difficulty, more and more loops below it."""

import numpy as np
from numpy.typing import NDArray

from sim.arenas.families.layout import WALL, Plan

# Fields along an edge at least, and the share of the remaining walls that is taken out in the easiest maze.
_FEWEST = 4
_OPEN = 0.5


def maze(plan: Plan) -> None:
    """Fill the plan: a random spanning tree over square fields (depth first), and walls between what it does not join."""
    # The pitch goes down to the tightest passage; an integer number of fields fills the floor.
    fields = max(_FEWEST, int(plan.size / (plan.passage + WALL)))
    right, up = _spanning_tree(fields, plan.random)
    chance = plan.between(_OPEN, 0.0)
    right |= plan.random.random(right.shape) < chance
    up |= plan.random.random(up.shape) < chance
    pitch = plan.size / fields
    for index in range(fields - 1):
        at = -plan.half + (index + 1) * pitch
        for across, closed in ((True, ~up[index]), (False, ~right[:, index])):
            for begin, end in _runs(closed):
                # Walls overlap at their ends, so that no corner has a notch.
                low = max(-plan.half + begin * pitch - 0.5 * WALL, -plan.half)
                high = min(-plan.half + end * pitch + 0.5 * WALL, plan.half)
                plan.strip(across, at, WALL, low, high)


def _spanning_tree(fields: int, random: np.random.Generator) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Open borders: (rows, columns - 1) to the right of a field and (rows - 1, columns) above it."""
    right = np.zeros((fields, fields - 1), dtype=np.bool_)
    up = np.zeros((fields - 1, fields), dtype=np.bool_)
    seen = {(0, 0)}
    stack = [(0, 0)]
    # Drawn at once: one random number a visit, and no field is visited more often than it has neighbours.
    draws = iter(random.random(5 * fields * fields).tolist())
    while stack:
        row, column = stack[-1]
        ways = [
            (r, c)
            for r, c in ((row, column + 1), (row, column - 1), (row + 1, column), (row - 1, column))
            if 0 <= r < fields and 0 <= c < fields and (r, c) not in seen
        ]
        if not ways:
            stack.pop()
            continue
        r, c = ways[int(next(draws) * len(ways))]
        if r == row:
            right[row, min(c, column)] = True
        else:
            up[min(r, row), column] = True
        seen.add((r, c))
        stack.append((r, c))
    return right, up


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and one past the last of every stretch of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]
