"""The two fixed arenas of the paper's experiments, 10 x 10 m."""

from functools import cache

import numpy as np

from sim.arenas.geometry import Arena

# The lineage of the paper's environment draws targets within 3.6 m of the centre and starts within 4.5 m.
_START_INSET = 0.5
_TARGET_INSET = 1.4

# Nine pillars and eight blocks. Every passage, between two of them or along a wall, is at least 0.8 m wide
# (tests/sim/test_arenas.py measures it).
_PILLARS = (
    (-1.2, 0.9, 0.35),
    (1.3, 0.9, 0.3),
    (0.85, -1.05, 0.3),
    (-0.9, -1.0, 0.25),
    (-3.6, -3.6, 0.3),
    (3.8, -3.7, 0.3),
    (-3.8, 3.75, 0.3),
    (3.8, 3.8, 0.3),
    (0.0, 1.9, 0.25),
)
_BLOCKS = (
    (-2.6, 2.4, 0.9, 0.25, 0.0),
    (2.4, 2.6, 0.25, 0.9, 0.0),
    (-2.2, -2.2, 0.25, 1.0, 0.0),
    (2.2, -2.4, 1.0, 0.25, 0.0),
    (0.1, 3.4, 0.3, 0.3, 0.0),
    (-3.8, -0.2, 0.3, 0.5, 0.0),
    (3.6, 0.3, 0.5, 0.25, 0.0),
    (0.2, -3.5, 0.25, 0.5, 0.0),
)


@cache
def simple_arena() -> Arena:
    """Four walls and nothing else."""
    return Arena("simple", start_inset=_START_INSET, target_inset=_TARGET_INSET)


@cache
def complex_arena() -> Arena:
    """Four walls and 17 obstacles: nine round pillars and eight rectangular blocks."""
    return Arena(
        "complex",
        circles=np.array(_PILLARS),
        boxes=np.array(_BLOCKS),
        start_inset=_START_INSET,
        target_inset=_TARGET_INSET,
    )


BUILTIN = {"simple": simple_arena, "complex": complex_arena}
