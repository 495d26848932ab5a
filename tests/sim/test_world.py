"""The engine's step as it is called: what it takes for actions, and what it refuses."""

import math

import numpy as np
import pytest

from sim.arenas import Arena
from sim.config import TaskConfig
from sim.engine.world import World

ROBOTS = 3
ACTIONS = np.array([[0.5, 0.25], [1.0, -1.0], [0.0, 0.5]], dtype=np.float32)


def stepped(actions: np.ndarray) -> np.ndarray:
    world = World(TaskConfig(), [Arena("empty")], ROBOTS, seed=0)
    world.reset()
    world.step(actions)
    return world.robots.observations.copy()


@pytest.mark.parametrize(
    "actions",
    [
        pytest.param(ACTIONS.astype(np.float64), id="of another type"),
        pytest.param(np.asfortranarray(ACTIONS), id="column by column"),
        pytest.param(np.repeat(ACTIONS, 2, axis=0)[::2], id="a part of more"),
        pytest.param(np.frombuffer(ACTIONS.tobytes(), dtype=np.float32).reshape(ROBOTS, 2), id="read only"),
    ],
)
def test_actions_may_lie_in_memory_as_they_like(actions: np.ndarray) -> None:
    np.testing.assert_array_equal(stepped(actions), stepped(ACTIONS))


@pytest.mark.parametrize("actions", [ACTIONS[:2], ACTIONS[:, :1], ACTIONS[0], np.zeros((ROBOTS, 2, 1), np.float32)])
def test_actions_of_another_shape_are_refused(actions: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"actions have the shape \(3, 2\), not "):
        stepped(actions)


def test_an_action_that_is_no_number_is_refused_with_its_robot() -> None:
    actions = ACTIONS.copy()
    actions[1, 0] = math.nan
    with pytest.raises(ValueError, match="the action of robot 1 is not finite"):
        stepped(actions)
