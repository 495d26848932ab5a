"""The time on one spot: numbers worked by hand, what begins it anew, and that trainings go on with it bit for bit."""

import numpy as np
import pytest

from sim.arenas import Arena
from sim.config import DwellPart, ObservationConfig, TaskConfig
from sim.engine.world import World
from sim.observations import observation_layout
from tests.sim.scenes import goes_on_bit_for_bit


def made(**task: object) -> World:
    config = TaskConfig.model_validate({"observation": ObservationConfig(parts=(DwellPart(),)), **task})
    world = World(config, (Arena("room", 5.0, 5.0),), 1, seed=0)
    world.reset(poses=(-3.0, 0.0, 0.0), targets=(0.0, 0.0))
    return world


def told(world: World, steps: int, linear: float, angular: float) -> float:
    for _ in range(steps):
        world.step(np.array([[linear, angular]], np.float32))
    return float(world.robots.observations[0, 0])


def test_four_seconds_on_one_spot_are_one_half() -> None:
    world = made()
    assert world.robots.observations[0, 0] == 0.0
    assert told(world, 20, 0.0, 1.0) == pytest.approx(0.5)  # 20 * 0.2 s = 4 s
    assert told(world, 40, 0.0, -1.0) == pytest.approx(0.75)  # 12 s / 16 s


def test_half_a_metre_on_it_begins_anew() -> None:
    world = made()
    # 0.05 m a step: after nine it is 0.45 m away, after ten 0.5 m.
    assert told(world, 9, 1.0, 0.0) == pytest.approx(1.8 / 5.8, abs=1e-5)
    assert told(world, 1, 1.0, 0.0) == 0.0
    assert told(world, 1, 1.0, 0.0) == pytest.approx(0.2 / 4.2, abs=1e-5)


def test_who_comes_back_before_that_has_stayed() -> None:
    world = made()
    told(world, 8, 1.0, 0.0)
    told(world, 16, 0.0, 1.0)  # 3.2 rad: about
    assert told(world, 6, 1.0, 0.0) == pytest.approx(6.0 / 10.0, abs=1e-5)  # 30 * 0.2 s


def test_a_new_target_and_a_new_episode_begin_it_anew() -> None:
    world = made(arrival_distance=0.3, step_limit=2000)
    while not world.robots.outcomes[0]:
        world.step(np.array([[1.0, 0.0]], np.float32))
    assert world.robots.observations[0, 0] == 0.0
    while not world.robots.terminations[0]:
        world.step(np.array([[1.0, 0.0]], np.float32))
    assert world.robots.observations[0, 0] == 0.0


def test_a_training_goes_on_bit_for_bit() -> None:
    goes_on_bit_for_bit(DwellPart(frames=2))


def test_its_number_has_a_name_and_a_range() -> None:
    (number,) = observation_layout(TaskConfig(observation=ObservationConfig(parts=(DwellPart(),)))).numbers
    assert (number.name, number.low, number.high) == ("dwell", 0.0, 1.0)
