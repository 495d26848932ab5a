"""Random arenas for the property tests."""

import numpy as np
from hypothesis import strategies as st

from sim.arenas import Arena


def random_arena(seed: int) -> Arena:
    """Up to 14 shapes, from needles to blocks, overlapping or not, in halls of every proportion."""
    rng = np.random.default_rng(seed)
    half = rng.uniform(2.0, 6.0, 2)
    circles, boxes = rng.integers(0, 8, 2)
    return Arena(
        f"random-{seed}",
        half_width=half[0],
        half_height=half[1],
        circles=np.column_stack([rng.uniform(-half, half, (circles, 2)), rng.choice([0.02, 0.1, 0.3, 0.8], circles)]),
        boxes=np.column_stack(
            [
                rng.uniform(-half, half, (boxes, 2)),
                rng.choice([0.01, 0.1, 0.5, 1.5], boxes),
                rng.choice([0.01, 0.1, 0.5], boxes),
                rng.choice([0.0, np.pi / 4, np.pi / 2], boxes) + rng.choice([0.0, 1.0], boxes) * rng.normal(size=boxes),
            ]
        ),
    )


arenas = st.integers(0, 2**32 - 1).map(random_arena)
