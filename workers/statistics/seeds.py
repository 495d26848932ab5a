"""What a few seeds say of all seeds: success rates, other metrics and curves, with intervals that cover.

The seed is what is independent here: all episodes of a seed are driven by one policy, so a thousand of them say much about
that policy and little about the next seed's. An interval is therefore Student's t on the seeds' values, and never narrower
than what their episodes alone would leave open: few seeds may agree by luck, and at the ceiling they always do.
`benchmarks/coverage.py` simulates how often these intervals hold the truth.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from sim.config import Frozen
from workers.statistics.intervals import CONFIDENCE, Floats, Interval, exact_interval, student_t, upper_bound

Unit = Literal["seeds", "episodes"]
"""What an interval is taken over, hence what it speaks of: all seeds of a configuration, or one policy alone."""

Band = tuple[Floats, Floats, Floats]
"""Mean, low and high, (points,) each."""


USELESS = 0.2
"""Where even the best seed arrives less often, half of it tells nothing: 1 % and 2 % have failed alike."""


class FailedSeeds(Frozen):
    """What a few seeds leave open about those that were not trained.

    A seed has failed if it arrives at most half as often as the best of them, or never. Where even the best hardly arrives
    (`USELESS`), or the worse of two is that bad, half of the best tells nothing: which have failed is not said then.

    Attributes:
        failed: seeds that have.
        seeds: of so many.
        at_most: share of all seeds that may fail, one-sided 95 %, exact.
        sentence: the same in words.
        told: whether these seeds can say at all which of them have failed; else `failed` counts those that never arrive.
    """

    failed: int
    seeds: int
    at_most: float
    sentence: str
    told: bool = True


def failed_seeds(rates: Sequence[float]) -> FailedSeeds:
    """What the success rates of at least one seed leave open."""
    best, seeds = max(rates), len(rates)
    useless = seeds > 1 and 0.0 < best < USELESS
    doubtful = seeds == 2 and not useless and 0.0 < min(rates) <= best / 2
    told = not useless and not doubtful
    failed = sum(rate <= (best / 2 if told else 0.0) for rate in rates)
    at_most = upper_bound(failed, seeds)
    if seeds == 1:
        sentence = f"One seed alone: of others up to {at_most:.0%} may fail (one-sided 95 %)."
    elif failed == seeds:
        sentence = f"All {seeds} seeds failed."
    elif useless:
        sentence = f"Even the best of {seeds} seeds arrives in {best:.0%} only: which have failed can't be said."
    elif doubtful:
        sentence = "One of 2 seeds arrives at most half as often as the other: which is the usual one two can't say."
    else:
        count = "None" if failed == 0 else str(failed)
        sentence = f"{count} of {seeds} seeds failed: up to {at_most:.0%} may (one-sided 95 %)."
    words = sentence.replace("%", " %").replace("  ", " ")
    return FailedSeeds(failed=failed, seeds=seeds, at_most=at_most, sentence=words, told=told)


def success_rate(arrivals: Sequence[float], episodes: Sequence[float], confidence: float = CONFIDENCE) -> Interval:
    """Mean success rate of the seeds, see `rates_band`; of one seed with the exact interval over its episodes.

    Args:
        arrivals: of each seed.
        episodes: of each seed, all above 0.
        confidence: of the interval.

    Raises:
        ValueError: no seeds, lengths that differ, or more arrivals than episodes.
    """
    if not arrivals or len(arrivals) != len(episodes):
        raise ValueError("arrivals and episodes need one number a seed")
    arrived, driven = np.asarray(arrivals, np.float64), np.asarray(episodes, np.float64)
    if len(arrivals) == 1:
        low, high = exact_interval(arrived, driven, confidence)
        return _first((arrived / driven, low, high))
    return _first(rates_band((arrived / driven)[:, None], driven[:, None], confidence))


def mean_over_seeds(episodes: Sequence[Floats], confidence: float = CONFIDENCE, least: float | None = None) -> Interval:
    """Mean over seeds of each seed's mean over its episodes, see `means_band`; of one seed Student's t over its episodes.

    Args:
        episodes: the values of each seed's episodes; seeds may have different numbers of them, none may have none.
        confidence: of the interval.
        least: what the measure can't be below, where the interval ends; None where it has no such end.

    Raises:
        ValueError: no seeds, or a seed without episodes.
    """
    if not episodes or any(values.size == 0 for values in episodes):
        raise ValueError("every seed needs at least one episode")
    if len(episodes) == 1:
        return _from(least, mean_interval(episodes[0].tolist(), confidence))
    means = np.array([[values.mean()] for values in episodes])
    errors = np.array([[values.std(ddof=1) / values.size**0.5 if values.size > 1 else 0.0] for values in episodes])
    return _from(least, _first(means_band(means, errors, confidence)))


def mean_interval(values: Sequence[float], confidence: float = CONFIDENCE) -> Interval:
    """The mean of independent values with Student's t (1908); one value is its own interval."""
    if len(values) == 1:
        return Interval(values[0], values[0], values[0])
    return _first(means_band(np.asarray(values, np.float64)[:, None], confidence=confidence))


def means_band(values: Floats, errors: Floats | None = None, confidence: float = CONFIDENCE) -> Band:
    """Mean over seeds with Student's t at each point, at least as wide as the seeds' own errors make it.

    Args:
        values: (seeds, points); nan where a seed has no value.
        errors: (seeds, points) standard error of each value, from the episodes behind it; None where it is not known.
        confidence: of the interval.

    Returns:
        Low and high are nan where fewer than two seeds have a value, the mean where none has.
    """
    count, mean, error = _spread(values)
    with np.errstate(invalid="ignore"):
        reach = student_t(np.maximum(count - 1, 1), confidence) * error
        if errors is not None:
            within = np.sqrt((np.where(np.isfinite(values), errors, 0.0) ** 2).sum(axis=0)) / np.maximum(count, 1)
            reach = np.fmax(reach, student_t(np.inf, confidence) * within)
        reach = np.where(count > 1, reach, np.nan)
    return mean, mean - reach, mean + reach


def rates_band(rates: Floats, episodes: Floats | None = None, confidence: float = CONFIDENCE) -> Band:
    """Mean of rates over seeds at each point, with Student's t on the scale of its logit, which ends at 0 and 1.

    The standard error of the mean is carried over to the logit by its slope there (the delta method), so the interval is
    the mean's. Where the episodes are known it is never narrower than the exact interval of all of them together.

    Args:
        rates: (seeds, points), 0 to 1; nan where a seed has no value.
        episodes: (seeds, points) behind each, or (seeds, 1); None where they are not known.
        confidence: of the interval.

    Returns:
        Low and high are nan where fewer than two seeds have a value, the mean where none has.
    """
    count, mean, error = _spread(rates)
    centre, exact = mean, None
    if episodes is not None:
        present = np.isfinite(rates)
        driven = np.where(present, episodes, 0.0)
        arrived = np.where(present, rates, 0.0) * driven
        total, good = driven.sum(axis=0), arrived.sum(axis=0)
        # Half an episode either way: the logit of 0 and 1 has no end.
        centre = np.where(total > 0, (good + 0.5) / (total + 1), np.nan)
        exact = exact_interval(np.minimum(good, total)[total > 0], total[total > 0], confidence)
    low, high = mean.copy(), mean.copy()
    inside = (centre > 0.0) & (centre < 1.0) & (count > 1)
    middle = centre[inside]
    reach = student_t(count[inside] - 1, confidence) * error[inside] / (middle * (1 - middle))
    logit = np.log(middle / (1 - middle))
    # Beyond 700 a float has no exponential.
    low[inside] = np.minimum(mean[inside], 1 / (1 + np.exp(np.minimum(reach - logit, 700.0))))
    high[inside] = np.maximum(mean[inside], 1 / (1 + np.exp(np.minimum(-reach - logit, 700.0))))
    if exact is not None:
        there = count > 0
        low[there], high[there] = np.minimum(low[there], exact[0]), np.maximum(high[there], exact[1])
    few = count < 2
    low[few] = high[few] = np.nan
    return mean, low, high


def interquartile_mean(values: Sequence[float]) -> float:
    """Mean without the lowest and the highest quarter, rounded down (Agarwal et al. 2021): of three values, of all.

    Raises:
        ValueError: there are no values.
    """
    if not values:
        raise ValueError("there is no mean of nothing")
    cut = len(values) // 4
    return float(np.mean(sorted(values)[cut : len(values) - cut]))


def _spread(values: Floats) -> Band:
    """How many seeds have a value, their mean, and its standard error, at each point."""
    present = np.isfinite(values)
    count = present.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(present, values, 0.0).sum(axis=0) / count
        squares = (np.where(present, values - mean, 0.0) ** 2).sum(axis=0)
        return count, np.where(count > 0, mean, np.nan), np.sqrt(squares / (count - 1) / count)


def _from(least: float | None, interval: Interval) -> Interval:
    return interval if least is None else Interval(interval.value, max(interval.low, least), interval.high)


def _first(band: Band) -> Interval:
    mean, low, high = (float(part[0]) for part in band)
    return Interval(mean, min(low, mean), max(high, mean))
