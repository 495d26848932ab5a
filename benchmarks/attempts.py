"""How a policy does on first attempts that no training sees: what the searches and the races to a success rate look at."""

from dataclasses import dataclass

import numpy as np

from sim.actions import action_layout
from sim.arrays import PolicyFunction
from sim.config import TaskConfig
from sim.envs.vector import NavigationVectorEnv

EPISODES = 1_000


@dataclass(frozen=True, slots=True)
class Attempts:
    """What became of a number of attempts.

    Attributes:
        success, timeouts: parts of them, 0 to 1; the others collided.
        steps: mean length.
        actions: mean of each number of an action, in fractions of its limit.
    """

    success: float
    timeouts: float
    steps: float
    actions: tuple[float, ...]


def first_attempts(policy: PolicyFunction, task: TaskConfig, seed: int) -> Attempts:
    """Lets 1,000 robots drive to their first targets, the same ones for every policy."""
    env = NavigationVectorEnv(task, EPISODES, seed=seed, copy=False)
    observations, _ = env.reset(seed=seed)
    outcomes = np.zeros(EPISODES, np.uint8)
    commands, steps = np.zeros(action_layout(task.robot).size), 0
    while not outcomes.all():
        actions = policy(observations)
        driving = outcomes == 0
        commands += actions[driving].sum(axis=0)
        steps += int(driving.sum())
        observations, *_ = env.step(actions)
        outcomes = np.where(outcomes, outcomes, env.outcomes)
    return Attempts(
        success=float((outcomes == 1).mean()),
        timeouts=float((outcomes == 3).mean()),
        steps=steps / EPISODES,
        actions=tuple((commands / steps).round(2).tolist()),
    )
