"""What a family of arenas draws with; NumPy only, so that the service can draw it as well.

>>> def pillars(plan: Plan, family: ArenaFamily) -> None:
...     for x, y in plan.random.uniform(-plan.half + 1.0, plan.half - 1.0, (10, 2)):
...         plan.circles.append((x, y, 0.15))

Whether a robot gets everywhere is checked by Mapless: a plan that is in two parts is drawn again, eight times at most.
"""

from sim.arenas.families.layout import WALL, Plan
from sim.extending.parts import ArenaFamily

__all__ = ["WALL", "ArenaFamily", "Plan"]
