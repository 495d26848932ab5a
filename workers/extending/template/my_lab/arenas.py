"""How the arenas are drawn: NumPy only, so that the server can show them."""

import numpy as np

from my_lab import PillarsFamily
from sim.extending.arenas import Plan


def pillars(plan: Plan, family: PillarsFamily) -> None:
    """Stand pillars about, with a passage between any two of them and along the walls."""
    wanted = round(plan.between(6.0, 24.0))
    gap = plan.passage
    limit = plan.half - gap - family.radius
    for place in plan.random.uniform(-limit, limit, (20 * wanted, 2)):
        far = all(np.hypot(*(place - (x, y))) > 2.0 * family.radius + gap for x, y, _ in plan.circles)
        if far and len(plan.circles) < wanted:
            plan.circles.append((float(place[0]), float(place[1]), family.radius))
