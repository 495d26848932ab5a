"""Random clutter: pillars and boxes that lie about at any angle, with a way between any two of them."""

import numpy as np

from sim.arenas.families.layout import Plan

# Obstacles on 100 square metres, and the radius of the circle around each, metres, from easy to hard.
_FEW, _MANY = 8.0, 40.0
_RADII_EASY, _RADII_HARD = (0.25, 0.7), (0.15, 0.55)
_PILLARS = 0.45
# How much wider than the robot's own space the gaps are, metres: less than other passages, for they are short.
_GAPS = (0.6, 0.2)
# Places tried for each obstacle before it is left out.
_TRIES = 60


def clutter(plan: Plan) -> None:
    """Fill the plan; a crowded floor may hold fewer obstacles than its difficulty asks for."""
    random = plan.random
    count = round(plan.between(_FEW, _MANY) * (plan.size / 10.0) ** 2)
    smallest = plan.between(_RADII_EASY[0], _RADII_HARD[0])
    largest = plan.between(_RADII_EASY[1], _RADII_HARD[1])
    placed = np.empty((0, 3))
    gap = 2.0 * plan.clearance + plan.between(*_GAPS)
    for radius in np.sort(random.uniform(smallest, largest, count))[::-1]:
        limit = plan.half - radius - gap
        spots = random.uniform(-limit, limit, (_TRIES, 2))
        gaps = np.hypot(*(spots[:, None] - placed[None, :, :2]).transpose(2, 0, 1)) - placed[:, 2] - radius
        fits = np.flatnonzero((gaps >= gap).all(axis=1))
        if len(fits) == 0:
            continue
        x, y = spots[fits[0]]
        placed = np.vstack([placed, (x, y, radius)])
        if random.random() < _PILLARS:
            plan.circles.append((x, y, radius))
        else:
            corner = random.uniform(0.15 * np.pi, 0.35 * np.pi)
            plan.boxes.append((x, y, radius * np.cos(corner), radius * np.sin(corner), random.uniform(0.0, np.pi)))
