"""An evaluation in the few numbers that every table shows (no NumPy: the server reads them)."""

from collections.abc import Sequence

from sim.config import Frozen
from workers.reporting import EpisodeResult
from workers.statistics import wilson_interval


class Figures(Frozen):
    """A policy or a baseline on a suite; rates are shares of the episodes, 0 to 1.

    Attributes:
        episodes: how many stand behind the rest.
        success, success_low, success_high: arrivals, with the 95 % Wilson interval.
        collision: episodes that ended in one.
        timeout: episodes that took too long.
        spl: success weighted by path length (Anderson et al. 2018), for paths up to the target's arrival circle.
        steps: control steps of the episodes that arrived; None where none did.
        min_clearance: mean of the episodes' smallest distance between body and anything else, metres.
    """

    episodes: int
    success: float
    success_low: float
    success_high: float
    collision: float
    timeout: float
    spl: float
    steps: float | None
    min_clearance: float


def figures(episodes: Sequence[EpisodeResult], arrival_distance: float) -> Figures:
    """The figures of some episodes, at least one.

    Args:
        episodes: of one policy on one suite.
        arrival_distance: of the task, metres.
    """
    count = len(episodes)
    arrivals = [episode for episode in episodes if episode.outcome == "arrival"]
    low, high = wilson_interval(len(arrivals), count)
    return Figures(
        episodes=count,
        success=len(arrivals) / count,
        success_low=low,
        success_high=high,
        collision=sum(episode.outcome == "collision" for episode in episodes) / count,
        timeout=sum(episode.outcome == "timeout" for episode in episodes) / count,
        spl=sum(episode.path_efficiency(arrival_distance) for episode in arrivals) / count,
        steps=sum(episode.steps for episode in arrivals) / len(arrivals) if arrivals else None,
        min_clearance=sum(episode.min_clearance for episode in episodes) / count,
    )
