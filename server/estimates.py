"""Measured numbers as JSON shows them: value, interval, what it is over, the seeds themselves and what they leave open."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from server.schemas import Estimate, SeedMean
from workers.statistics.intervals import Floats, Interval
from workers.statistics.seeds import Band, FailedSeeds, failed_seeds, mean_over_seeds, means_band, rates_band, success_rate

_RATE, _LEARNING_RATE = "_rate", "learning_rate"
_STEPS = "/steps"
# Lists ask for the same ones again and again.
_REMEMBERED = 8_192


def success_estimate(arrivals: Sequence[int], episodes: Sequence[int], *, trained: bool = True) -> Estimate:
    """Success rate over seeds.

    Args:
        arrivals: of each seed.
        episodes: of each seed.
        trained: whether another seed could have failed, as none of a baseline can.
    """
    return _success(tuple(arrivals), tuple(episodes), trained)


@lru_cache(_REMEMBERED)
def _success(arrivals: tuple[int, ...], episodes: tuple[int, ...], trained: bool) -> Estimate:
    rates = [arrived / driven for arrived, driven in zip(arrivals, episodes, strict=True)]
    failed = failed_seeds(rates) if trained else None
    return _estimate(success_rate(arrivals, episodes), rates, sum(episodes), failed)


def mean_estimate(samples: Sequence[Floats], *, least: float | None = None) -> Estimate | None:
    """Mean over the seeds that have any episode to show; None where none has.

    Args:
        samples: the values of each seed's episodes.
        least: what the measure can't be below; None where there is nothing of the kind.
    """
    shown = [values for values in samples if values.size]
    if not shown:
        return None
    means = [float(values.mean()) for values in shown]
    return _estimate(mean_over_seeds(shown, least=least), means, sum(values.size for values in shown), None)


def is_rate(name: str) -> bool:
    """Whether a metric is a share, 0 to 1, whose interval ends there."""
    return name.endswith(_RATE) and not name.endswith(_LEARNING_RATE)


def metric_band(name: str, values: Floats, episodes: Floats | None = None) -> Band:
    """A metric's mean over runs with its interval at each point, which ends where the metric does.

    Args:
        name: of the metric.
        values: (runs, points); nan where a run has none.
        episodes: (runs, points) behind each, or (runs, 1), of a rate; None where they are not known.
    """
    if is_rate(name):
        return rates_band(values, episodes)
    mean, low, high = means_band(values)
    return mean, np.maximum(low, 0.0) if name.endswith(_STEPS) else low, high


def last_values(name: str, values: Floats) -> list[SeedMean | None]:
    """What the newest values of a metric say over runs, for several sets of runs at once.

    Args:
        name: of the metric.
        values: (runs, sets); nan where a set has no such run, or the run no such value.

    Returns:
        One a set; None where no run has a value.
    """
    if values.size == 0:
        return [None] * values.shape[1]
    mean, low, high = metric_band(name, values)
    runs = np.isfinite(values).sum(axis=0)
    return [
        _seed_mean(*figures) if figures[-1] else None
        for figures in zip(mean.tolist(), low.tolist(), high.tolist(), runs.tolist(), strict=True)
    ]


def in_short(estimate: Estimate) -> SeedMean:
    """An estimate without what stands behind it."""
    over_seeds = estimate.unit == "seeds"
    return SeedMean(
        value=estimate.value,
        low=estimate.low if over_seeds else None,
        high=estimate.high if over_seeds else None,
        runs=estimate.seeds,
    )


def _seed_mean(mean: float, low: float, high: float, runs: int) -> SeedMean:
    known = runs > 1
    return SeedMean(value=mean, low=min(low, mean) if known else None, high=max(high, mean) if known else None, runs=runs)


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
