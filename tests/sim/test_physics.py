"""The Space that all robots share: how it finds who touches what changes nothing of where they go."""

import gc

import numpy as np
import pytest

from sim.config import GeneratedArenaConfig, TaskConfig
from sim.engine import physics
from sim.envs.vector import NavigationVectorEnv
from sim.kernels.records import COLLISION


def driven(robots: int = 24, steps: int = 400) -> dict[str, np.ndarray]:
    """Where robots are after driving about among pillars that they touch."""
    arena = GeneratedArenaConfig(name="thicket", difficulty=1.0, maps=12, seed=3)
    env = NavigationVectorEnv(TaskConfig(arena=arena, collision_distance=0.0), robots, seed=5)
    env.reset(seed=5)
    random = np.random.default_rng(5)
    touched = 0
    for _ in range(steps):
        env.step(random.uniform(-0.2, 1.0, (robots, 2)).astype(np.float32))
        touched += int(np.count_nonzero(env.outcomes == COLLISION))
    return {**env.get_state(), "touched": np.array(touched)}


def test_robots_go_where_they_went_whatever_the_slots_of_the_hash(monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for slots in (1_000_003, 1_009, 7):
        monkeypatch.setattr(physics, "_hash_slots", lambda shapes, robots, slots=slots: slots)
        found.append(driven())
    assert found[0]["touched"] > 0
    for name, array in found[0].items():
        assert all(np.array_equal(array, other[name]) for other in found[1:]), name


def test_many_shapes_have_fewer_slots_than_two_each() -> None:
    assert physics._hash_slots(600_000, 512) < 600_000
    assert physics._hash_slots(40, 16) == 80


def test_python_looks_for_garbage_again_once_the_shapes_are_there() -> None:
    driven(robots=1, steps=1)
    assert gc.isenabled()
