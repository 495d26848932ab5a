"""Another family on every map: for policies that should find their way wherever they are.

`varied` has more of the maps in which a robot that remembers nothing is lost, `intricate` also of those with narrow gaps.
"""

from collections.abc import Callable

import numpy as np

from sim.arenas.families.clutter import clutter
from sim.arenas.families.layout import Plan
from sim.arenas.families.maze import maze
from sim.arenas.families.partition import corridors, rooms
from sim.arenas.families.passages import passages
from sim.arenas.families.thicket import thicket
from sim.arenas.families.warehouse import warehouse

_Shares = tuple[tuple[Callable[[Plan], None], float], ...]

# Share of the maps that are of each family.
_VARIED: _Shares = (
    (rooms, 0.25),
    (maze, 0.25),
    (passages, 0.15),
    (thicket, 0.12),
    (warehouse, 0.10),
    (corridors, 0.07),
    (clutter, 0.06),
)
_INTRICATE: _Shares = (
    (rooms, 0.19),
    (maze, 0.27),
    (passages, 0.10),
    (thicket, 0.26),
    (warehouse, 0.06),
    (corridors, 0.03),
    (clutter, 0.09),
)


def varied(plan: Plan) -> None:
    """Fill the plan as one of the seven families, drawn first: half of them rooms and mazes."""
    _one_of(_VARIED, plan)


def intricate(plan: Plan) -> None:
    """Fill the plan as one of the seven families, drawn first: half of them mazes and thickets."""
    _one_of(_INTRICATE, plan)


def _one_of(shares: _Shares, plan: Plan) -> None:
    up_to = np.cumsum([share for _, share in shares])
    which = int(np.searchsorted(up_to[:-1], plan.random.random(), side="right"))
    family, _ = shares[which]
    family(plan)
