"""Clutter on one map, a thicket on the next: for policies that should know gaps of every kind."""

from sim.arenas.families.clutter import clutter
from sim.arenas.families.layout import Plan
from sim.arenas.families.thicket import thicket

# Share of the maps that are thickets, which take longer to learn.
_THICKETS = 0.7


def mixed(plan: Plan) -> None:
    """Fill the plan as one of the two families, drawn first: those in which a robot without memory finds its way."""
    family = thicket if plan.random.random() < _THICKETS else clutter
    family(plan)
