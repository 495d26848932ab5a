"""Warehouse aisles: parallel rows of racks with aisles between them, and cross aisles through the rows."""

import numpy as np

from sim.arenas.families.layout import Plan

# Depth of a rack and the shortest piece of one, metres.
_DEPTH = 0.9
_SHORTEST = 0.6
# Chance that a piece of rack is not there, and cross aisles on 10 m, from easy to hard.
_MISSING = (0.3, 0.04)
_CROSSINGS = (2.4, 0.6)


def warehouse(plan: Plan) -> None:
    """Fill the plan: an aisle along every wall, so that no aisle is a trap for good."""
    aisle = plan.passage
    span = plan.size - 2.0 * aisle
    rows = max(1, int((span + aisle) / (_DEPTH + aisle)))
    depth = (span - (rows - 1) * aisle) / rows if rows > 1 else min(span, 3.0 * _DEPTH)
    depth = min(depth, 2.0 * _DEPTH)
    pitch = (span - depth) / (rows - 1) if rows > 1 else 0.0
    first = -plan.half + aisle + 0.5 * depth if rows > 1 else 0.0
    for row in range(rows):
        for low, high in _pieces(plan, -plan.half + aisle, plan.half - aisle, aisle):
            if plan.random.random() >= plan.between(*_MISSING):
                plan.strip(True, first + row * pitch, depth, low, high)


def _pieces(plan: Plan, low: float, high: float, aisle: float) -> list[tuple[float, float]]:
    """A row of racks from `low` to `high`, cut by cross aisles."""
    wanted = plan.random.poisson(plan.between(*_CROSSINGS) * plan.size / 10.0)
    # Racks share what the cross aisles leave: each gets its shortest length and a random part of the rest.
    crossings = min(int(wanted), int((high - low - _SHORTEST) / (aisle + _SHORTEST)))
    spare = high - low - crossings * aisle - (crossings + 1) * _SHORTEST
    shares = plan.random.dirichlet(np.full(crossings + 1, 2.0))
    pieces, begin = [], low
    for share in shares:
        end = begin + _SHORTEST + spare * float(share)
        pieces.append((begin, min(end, high)))
        begin = end + aisle
    return pieces
