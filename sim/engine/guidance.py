"""What only a simulator knows of the way ahead: for critics, which need no map once the training is over.

A value that is learned from what the robot sees has to guess how far the target is round the walls that it does not see; one
that is told guesses nothing, and what it says of an action is clearer (Pinto et al. 2018, "Asymmetric Actor Critic").
"""

import numpy as np
from numpy.typing import NDArray

from sim.config import TaskConfig
from sim.engine.paths import RobotPaths
from sim.kernels.bundles import Robots
from sim.kernels.paths import guide

GUIDANCE_SIZE = 5
"""Numbers of a robot: the shortest path's length l as l / (l + 5 m) and as l / 20 m, sine and cosine of the direction in
which it sets out against the robot's heading, and how much of the attempt's steps is over, 0 to 1."""


class Guidance:
    """What robots would have to know of the shortest paths to their targets.

    Args:
        task: what they do.
        paths: of the robots.
        robots: how many.

    Attributes:
        now: (N, 5) at the places that the newest observations are of; `GUIDANCE_SIZE` says what.
        final: (N, 5) at those of the last observations of episodes that ended in the last step; elsewhere meaningless.
    """

    def __init__(self, task: TaskConfig, paths: RobotPaths, robots: int) -> None:
        self.now, self.final = np.zeros((2, robots, GUIDANCE_SIZE), np.float32)
        self._paths, self._step_limit = paths, float(task.step_limit)

    def tell(self, robots: Robots, which: NDArray[np.bool_]) -> None:
        """Write what some robots (N,), which have been looked at, would have to know where they are."""
        guide(which, robots, self._paths.lengths, self._paths.firsts, self._step_limit, self.now)

    def keep(self, robots: Robots, ended: NDArray[np.bool_]) -> None:
        """Keep as `final` what robots (N,) would have to know whose episodes have just ended, where they still are."""
        self.final[ended] = self.now[ended]
        self.final[ended, 4] = robots.records["steps"][ended] / self._step_limit
