"""Narrow passages: barriers from wall to wall, each with one opening, and pillars in the halls between them."""

from sim.arenas.families.layout import Plan

# Barriers on 10 m, and how thick they are at most, metres, from easy to hard.
_BARRIERS = (1.0, 5.0)
_THICKNESS = (0.2, 1.0)
_THINNEST = 0.12
_PILLAR = 0.15


def passages(plan: Plan) -> None:
    """Fill the plan: the way through is never straight, and as narrow as the difficulty says."""
    barriers = max(1, round(plan.between(*_BARRIERS) * plan.size / 10.0))
    thickest = min(plan.between(*_THICKNESS), plan.size / (barriers + 1) - plan.passage)
    pitch = plan.size / (barriers + 1)
    half_opening = 0.5 * plan.passage
    for index in range(barriers):
        at = -plan.half + (index + 1) * pitch
        thickness = max(_THINNEST, plan.random.uniform(0.5, 1.0) * thickest)
        middle = plan.random.uniform(-plan.half + half_opening + 0.2, plan.half - half_opening - 0.2)
        plan.strip(True, at, thickness, -plan.half, middle - half_opening)
        plan.strip(True, at, thickness, middle + half_opening, plan.half)
    # A pillar in the middle of a hall leaves a passage on both sides of it, and is left out where it would not.
    hall = pitch - thickest
    if hall < 2.0 * (plan.passage + _PILLAR):
        return
    for index in range(barriers + 1):
        x = plan.random.uniform(-plan.half, plan.half) * (1.0 - 2.0 * (plan.passage + _PILLAR) / plan.size)
        plan.circles.append((x, -plan.half + (index + 0.5) * pitch, _PILLAR))
