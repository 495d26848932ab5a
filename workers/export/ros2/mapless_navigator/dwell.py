"""How long a robot has stayed about where it is.

As in training a stay begins where the robot is 0.48 m away from where the last one began. The one number is t / (t + 4 s),
t seconds since then.
"""

import numpy as np
from numpy.typing import ArrayLike

from .observation import Reals
from .policy import Specification

AWAY = 0.48
LONG = 4.0


class Dwell:
    """The stay of one robot on its way to one goal.

    Args:
        specification: of a policy that sees how long it has stayed.

    Attributes:
        kind: of the part that it makes the number of.
    """

    kind = "dwell"

    def __init__(self, specification: Specification) -> None:
        self._period = specification.control_period
        self.clear()

    def clear(self) -> None:
        """Forget it: a new way begins."""
        self._begin: Reals | None = None
        self._steps = 0

    def see(self, ranges: ArrayLike, pose: ArrayLike) -> Reals:
        """Tell how long it has stayed; once per control period.

        Args:
            ranges: (scan,) metres, which tell nothing of it.
            pose: x, y in metres and heading in radians.

        Returns:
            (1,).
        """
        here = np.asarray(pose, np.float64)[:2]
        if self._begin is None or np.hypot(*(here - self._begin)) >= AWAY:
            self._begin, self._steps = here, 0
        else:
            self._steps += 1
        seconds = self._steps * self._period
        return np.array([seconds / (seconds + LONG)])
