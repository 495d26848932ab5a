"""Measured numbers as JSON shows them: value, interval, what it is over, the seeds themselves and what they leave open."""

from collections.abc import Sequence

from server.schemas import Estimate
from workers.statistics.intervals import Floats, Interval
from workers.statistics.seeds import FailedSeeds, failed_seeds, mean_over_seeds, success_rate


def success_estimate(arrivals: Sequence[int], episodes: Sequence[int], *, trained: bool = True) -> Estimate:
    """Success rate over seeds.

    Args:
        arrivals: of each seed.
        episodes: of each seed.
        trained: whether another seed could have failed, as none of a baseline can.
    """
    rates = [arrived / driven for arrived, driven in zip(arrivals, episodes, strict=True)]
    failed = failed_seeds(rates) if trained else None
    return _estimate(success_rate(arrivals, episodes), rates, sum(episodes), failed)


def mean_estimate(samples: Sequence[Floats]) -> Estimate | None:
    """Mean over the seeds that have any episode to show; None where none has.

    Args:
        samples: the values of each seed's episodes.
    """
    shown = [values for values in samples if values.size]
    if not shown:
        return None
    means = [float(values.mean()) for values in shown]
    return _estimate(mean_over_seeds(shown), means, sum(values.size for values in shown), None)


def _estimate(interval: Interval, per_seed: list[float], episodes: int, failed: FailedSeeds | None) -> Estimate:
    return Estimate(
        value=interval.value,
        low=interval.low,
        high=interval.high,
        unit="seeds" if len(per_seed) > 1 else "episodes",
        seeds=len(per_seed),
        episodes=episodes,
        per_seed=per_seed,
        failed=failed,
    )
