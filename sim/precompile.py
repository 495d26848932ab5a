"""Compile the simulator's kernels into the cache beside them; `workers.precompile` does this and more."""

import numpy as np

from sim.arenas import build_arenas
from sim.config import ArenaConfig, MoversConfig, TaskConfig
from sim.envs.vector import NavigationVectorEnv
from sim.scan import clearances, scan


def main() -> None:
    """Call everything that is compiled once."""
    # One mover: what moves is compiled too.
    task = TaskConfig(arena=ArenaConfig(movers=MoversConfig(count=1)))
    arena = build_arenas(task.arena)[0]
    scan(arena, np.zeros((1, 3)))
    clearances(arena, np.zeros((1, 2)))
    env = NavigationVectorEnv(task, 2, seed=0)
    env.reset()
    env.step(np.zeros((2, 2), dtype=np.float32))
