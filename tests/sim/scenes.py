"""Random arenas for the property tests, LiDARs of every kind, and a training that is interrupted."""

import numpy as np
from hypothesis import strategies as st

from sim.arenas import Arena
from sim.config import (
    BearingPart,
    DoubleMount,
    GeneratedArenaConfig,
    LidarConfig,
    ObservationConfig,
    ObservationPart,
    RangesPart,
    TaskConfig,
)
from sim.envs.vector import NavigationVectorEnv


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

LIDARS = {
    "full circle": LidarConfig(rays=120, field_of_view=360.0),
    "half": LidarConfig(rays=30),
    "three rays": LidarConfig(rays=3, field_of_view=60.0),
    "turned": LidarConfig(rays=31, field_of_view=270.0, mount={"name": "single", "x": 0.05, "yaw": 40.0}),
    "two": LidarConfig(rays=20, mount=DoubleMount()),
}


def goes_on_bit_for_bit(part: ObservationPart) -> None:
    """Robots that see a part besides ranges and bearing: from a state that was kept they go on as those that drove on."""
    task = TaskConfig(
        arena=GeneratedArenaConfig(name="varied", maps=4),
        observation=ObservationConfig(parts=(RangesPart(), BearingPart(), part)),
        arrival_ends=True,
    )
    first, second = (NavigationVectorEnv(task, 8, seed=1) for _ in range(2))
    first.reset()
    actions = np.random.default_rng(0).uniform([0.3, -1.0], 1.0, (200, 8, 2)).astype(np.float32)
    for action in actions[:100]:
        first.step(action)
    second.set_state(first.get_state())
    for action in actions[100:]:
        ours, theirs = (env.step(action) for env in (first, second))
        for one, other in zip(ours[:4], theirs[:4], strict=True):
            assert np.array_equal(one, other)
