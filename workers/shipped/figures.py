"""An evaluation in the few numbers that every table shows (no NumPy: the server reads them)."""

import math
from collections.abc import Sequence

from sim.config import Frozen
from workers.reporting import EpisodeResult
from workers.statistics.intervals import Interval
from workers.statistics.seeds import success_rate

_TENTH = 0.1


class Figures(Frozen):
    """A policy or a baseline on a suite; rates are shares of the episodes, 0 to 1.

    Attributes:
        episodes: how many stand behind the rest.
        success: arrivals.
        collision: episodes that ended in one.
        timeout: episodes that took too long.
        spl: success weighted by path length (Anderson et al. 2018), for paths up to the target's arrival circle.
        steps: control steps of the episodes that arrived; None where none did.
        min_clearance: mean of the episodes' smallest distance between body and anything else, metres.
    """

    episodes: int
    success: float
    collision: float
    timeout: float
    spl: float
    steps: float | None
    min_clearance: float

    @property
    def arrivals(self) -> int:
        """Episodes that arrived."""
        return round(self.success * self.episodes)

    @property
    def success_interval(self) -> Interval:
        """Success with the exact 95 % interval over the episodes of this one policy."""
        return success_rate([self.arrivals], [self.episodes])


def figures(episodes: Sequence[EpisodeResult], arrival_distance: float) -> Figures:
    """The figures of some episodes, at least one.

    Args:
        episodes: of one policy on one suite.
        arrival_distance: of the task, metres.
    """
    count = len(episodes)
    arrivals = [episode for episode in episodes if episode.outcome == "arrival"]
    return Figures(
        episodes=count,
        success=len(arrivals) / count,
        collision=sum(episode.outcome == "collision" for episode in episodes) / count,
        timeout=sum(episode.outcome == "timeout" for episode in episodes) / count,
        spl=sum(episode.path_efficiency(arrival_distance) for episode in arrivals) / count,
        steps=sum(episode.steps for episode in arrivals) / len(arrivals) if arrivals else None,
        min_clearance=sum(episode.min_clearance for episode in episodes) / count,
    )


def worst_tenth(merits: Sequence[float]) -> float:
    """Mean over the tenth of the episodes, at least one, that did worst; 0 is the merit of one that did not arrive."""
    worst = sorted(merits)[: math.ceil(_TENTH * len(merits))]
    return sum(worst) / len(worst)
