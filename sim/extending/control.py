"""What a baseline drives with: situations of the robots under way to their actions.

>>> import numpy as np
>>> def straight_on(baseline: Baseline, task: TaskConfig) -> Controller:
...     return lambda situation: np.tile(np.array([1.0, 0.0], np.float32), (len(situation.poses), 1))
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sim.arrays import Floats
from sim.config import TaskConfig
from sim.extending.parts import Baseline
from sim.suites import Situation, Suite, load_suite, run_controller

__all__ = ["Baseline", "Controller", "Floats", "Situation", "Suite", "TaskConfig", "drive", "load_suite"]

Controller = Callable[[Situation], Floats]
"""Called with fewer robots as they finish."""

_OUTCOMES = np.array(["none", "arrival", "collision", "timeout"])


def drive(controller: Controller, task: TaskConfig, suite: Suite) -> NDArray[np.str_]:
    """How the attempts of a suite end, (S,): arrival, collision or timeout."""
    outcomes: NDArray[np.str_] = _OUTCOMES[run_controller(controller, task, suite).outcomes]
    return outcomes
