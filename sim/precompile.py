"""Compile the simulator's kernels into the cache beside them; `workers.precompile` does this and more."""

import numpy as np

from sim.arenas import build_arenas
from sim.config import ArenaConfig, MoversConfig, ObservationConfig, PathProgressTerm, RewardConfig, TaskConfig, TrailPart
from sim.engine.paths import Paths
from sim.envs.vector import NavigationVectorEnv
from sim.scan import clearances, scan


def main() -> None:
    """Call everything that is compiled once."""
    # One mover: what moves is compiled too.
    task = TaskConfig(arena=ArenaConfig(movers=MoversConfig(count=1)))
    arena = build_arenas(task.arena)[0]
    scan(arena, np.zeros((1, 3)))
    clearances(arena, np.zeros((1, 2)))
    ways = Paths([arena], task.path_clearance)
    ways.length(0, (-4.0, -4.0), (4.0, 4.0))
    ways.slot(0, 0)
    # The usual robot, one that sees more than a scan and is paid by the shortest path, and several together.
    rewards = RewardConfig(terms=(PathProgressTerm(),))
    sees = task.model_copy(update={"observation": ObservationConfig(parts=(TrailPart(),)), "reward": rewards})
    for each, guides in ((task, False), (sees, True), (TaskConfig(together=2), False)):
        env = NavigationVectorEnv(each, 2, seed=0, guides=guides)
        env.reset()
        env.step(np.zeros((2, 2), dtype=np.float32))
