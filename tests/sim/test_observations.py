"""What the numbers of an observation are: their layout, and stacked frames."""

import numpy as np
import pytest

from sim.config import ArenaConfig, ObservationName, TaskConfig
from sim.envs.vector import NavigationVectorEnv
from sim.observations import observation_layout, observation_size


@pytest.mark.parametrize("observation", ["paper", "improved"])
def test_a_stacked_observation_is_the_newest_and_those_of_the_steps_before(observation: ObservationName) -> None:
    task = TaskConfig(arena=ArenaConfig(name="complex"), observation=observation, step_limit=40)
    single, stacked = (NavigationVectorEnv(task.model_copy(update={"frames": k}), 50, seed=2) for k in (1, 3))
    seen = [single.reset()[0]] * 3
    assert np.array_equal(stacked.reset()[0], np.concatenate(seen, axis=1))
    ended = 0
    for action in np.random.default_rng(0).uniform([0.0, -1.0], 1.0, (150, 50, 2)).astype(np.float32):
        newest, *_ = single.step(action)
        stack, _, terminated, truncated, _ = stacked.step(action)
        over = terminated | truncated
        last = np.concatenate([single.final_observations, seen[0], seen[1]], axis=1)
        assert np.array_equal(stacked.final_observations[over], last[over])
        # A new episode begins with its first frame repeated.
        seen = [newest, *(np.where(over[:, None], newest, before) for before in seen[:2])]
        assert np.array_equal(stack, np.concatenate(seen, axis=1))
        assert stacked.observation_space.contains(stack)
        ended += over.sum()
    assert ended > 50


def test_every_number_has_a_name_of_its_own_and_says_when_it_was() -> None:
    single, stacked = TaskConfig(), TaskConfig(frames=3)
    numbers = observation_layout(stacked).numbers
    assert (observation_size(single), observation_size(stacked), len(numbers)) == (16, 48, 48)
    assert numbers[:16] == observation_layout(single).numbers
    assert len({number.name for number in numbers}) == 48
    assert (numbers[29].name, numbers[29].formula) == ("bearing, 1 before", "bearing 1 step before")
    assert numbers[45].formula == "bearing 2 steps before"
    assert (numbers[45].low, numbers[45].high) == (-1.0, 1.0)


def test_a_state_holds_the_frames() -> None:
    task = TaskConfig(arena=ArenaConfig(name="complex"), frames=4)
    envs, other = (NavigationVectorEnv(task, 10, seed=seed) for seed in (1, 2))
    envs.reset()
    other.reset()
    actions = np.random.default_rng(0).uniform([0.0, -1.0], 1.0, (60, 10, 2)).astype(np.float32)
    for action in actions[:30]:
        envs.step(action)
    other.set_state(envs.get_state())
    for action in actions[30:]:
        assert np.array_equal(envs.step(action)[0], other.step(action)[0])
