"""Another family on every map: for policies that should find their way wherever they are."""

import numpy as np

from sim.arenas.families.clutter import clutter
from sim.arenas.families.layout import Plan
from sim.arenas.families.maze import maze
from sim.arenas.families.partition import corridors, rooms
from sim.arenas.families.passages import passages
from sim.arenas.families.thicket import thicket
from sim.arenas.families.warehouse import warehouse

# Share of the maps that are of each family: more of those in which a robot that remembers nothing is lost.
_SHARES = (
    (rooms, 0.25),
    (maze, 0.25),
    (passages, 0.15),
    (thicket, 0.12),
    (warehouse, 0.10),
    (corridors, 0.07),
    (clutter, 0.06),
)
_UP_TO = np.cumsum([share for _, share in _SHARES])


def varied(plan: Plan) -> None:
    """Fill the plan as one of the seven families, drawn first."""
    which = int(np.searchsorted(_UP_TO[:-1], plan.random.random(), side="right"))
    family, _ = _SHARES[which]
    family(plan)
