"""In which maps of a pool episodes begin, where those that teach the most are to come more often."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.config import ArenaPool, TaskConfig

KEPT = 0.9
"""What remains of an attempt's weight with each later one in its map: p is of the last ten or so."""

UNIFORM_SHARE = 0.5
"""Of the episodes, which begin in any map: what is learned by heart, or seems out of reach, is tried again."""


def samples_by_learnability(task: TaskConfig, maps: int) -> bool:
    """Whether this task's episodes begin more often in some of so many maps than in others."""
    return maps > 1 and isinstance(task.arena, ArenaPool) and task.arena.map_sampling == "learnability"


class MapSampling:
    """How likely each map is where episodes begin: half are in any map, half in proportion to p (1 - p).

    p is the share of a map's attempts that arrive. Where all do or none does there is little to learn; the most is where
    half do (Tzannetos et al. 2023, "Proximal Curriculum for Reinforcement Learning Agents"; Rutherford et al. 2024, "No
    Regrets", whose learnability this is). A map counts as tried once more, with half an arrival: one that was never tried
    is as promising as any.

    Args:
        maps: how many, M.

    Attributes:
        chances: (M,) float64, of each map and all before it together; ends at 1. Overwritten by `learn`.
    """

    def __init__(self, maps: int) -> None:
        self._tried, self._arrived = np.zeros((2, maps))
        self.chances = np.empty(maps)
        self._weigh()

    def learn(self, maps: Sequence[int], arrived: Sequence[bool]) -> None:
        """Attempts in some maps have ended.

        Args:
            maps: (n,) in which, one after the other.
            arrived: (n,) whether they reached their targets.
        """
        for map_, came in zip(maps, arrived, strict=True):
            self._tried[map_] = KEPT * self._tried[map_] + 1.0
            self._arrived[map_] = KEPT * self._arrived[map_] + came
        self._weigh()

    def state(self) -> dict[str, NDArray[np.generic]]:
        """The arrays that the future depends on."""
        return {"map_attempts": self._tried, "map_arrivals": self._arrived, "map_chances": self.chances}

    def _weigh(self) -> None:
        p = (self._arrived + 0.5) / (self._tried + 1.0)
        taught = p * (1.0 - p)
        shares = UNIFORM_SHARE / len(p) + (1.0 - UNIFORM_SHARE) * taught / taught.sum()
        np.cumsum(shares, out=self.chances)
        # The last one's sum is 1 but for rounding, and a drawn number may be as close to 1 as that.
        self.chances[-1] = 1.0
