"""Drives: a policy measured as the paper's tables measure one, target after target for a fixed number of steps."""

import numpy as np

from sim.arrays import PolicyFunction
from sim.config import TaskConfig
from sim.drivers import Driver
from sim.envs.vector import NavigationVectorEnv
from workers.training.table import TableRow

# Of the drives' own starts and targets, apart from every training's.
_SEED = 1_000_003


def drive(policy: PolicyFunction, task: TaskConfig, drives: int, steps: int) -> TableRow:
    """Measures a policy on its training's task.

    Args:
        policy: observations to actions, deterministic.
        task: what it was trained for.
        drives: robots, each alone; every training meets the same starts.
        steps: of each.

    Returns:
        Figures of one drive, the mean of all of them.
    """
    env = NavigationVectorEnv(task, drives, seed=_SEED, copy=False)
    observations, _ = env.reset(seed=_SEED)
    outcomes, reward = np.zeros(4, np.int64), 0.0
    driver = Driver(policy, drives)
    for _ in range(steps):
        observations, rewards, terminations, truncations, _ = env.step(driver(observations))
        driver.forget(terminations | truncations)
        outcomes += np.bincount(env.outcomes, minlength=4)
        reward += float(rewards.sum())
    attempts = max(1, int(outcomes[1:].sum()))
    return TableRow(
        reward=reward / (drives * steps),
        episodes=attempts / drives,
        success=int(outcomes[1]) / attempts,
        collisions=int(outcomes[2]) / attempts,
        steps=drives * steps / attempts,
    )
