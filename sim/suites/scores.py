"""The score of the BARN challenge, for comparison with what others report."""

import numpy as np
from numpy.typing import NDArray

from sim.config import TaskConfig
from sim.suites import EpisodeTable

ARRIVAL = 1  # of `EpisodeTable.outcomes`


def barn_score(table: EpisodeTable, task: TaskConfig) -> NDArray[np.float64]:
    """Score of each scenario, (S,) in [0, 0.5]: 0 without an arrival, else the better the nearer to the optimal time.

    OT / clip(AT, 2 OT, 8 OT), with AT the time taken and OT that of the shortest path at top speed (Xiao et al. 2022,
    *Autonomous Ground Navigation in Highly Constrained Spaces*); the shortest paths are the suite's.
    """
    optimal = np.maximum(table.shortest_paths, 1e-9) / task.robot.max_linear_speed
    taken = table.steps * task.control_period
    score: NDArray[np.float64] = (table.outcomes == ARRIVAL) * optimal / np.clip(taken, 2.0 * optimal, 8.0 * optimal)
    return score
