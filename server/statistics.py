"""What may be said from a few seeds and many episodes: rates, interquartile means, and their 95 % intervals (NumPy only).

The definitions are those of Agarwal et al. 2021, *Deep Reinforcement Learning at the Edge of the Statistical Precipice*
(the paper behind `rliable`), for the interquartile mean and its bootstrap, and of Wilson 1927 for rates.

The seed is what is independent here: all episodes of a seed are driven by one policy, so a thousand of them say much about
that policy and little about the next seed's. Every interval below is taken over seeds first and over episodes within them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import workers.statistics

FloatArray = NDArray[np.float64]

_QUANTILES = (0.025, 0.975)
_RESAMPLES = 2_000
# Intervals must not flicker between two looks at the same data.
_RANDOM_SEED = 20_210_830
# Bounds the memory of one bootstrap step: this many floats are 32 MB.
_MAX_DRAWS = 4_000_000


@dataclass(frozen=True, slots=True)
class Interval:
    """A number with its 95 % interval, low <= value <= high."""

    value: float
    low: float
    high: float


def wilson_interval(successes: float, trials: float) -> Interval:
    """Rate of `successes` among `trials` independent attempts, with Wilson's score interval.

    Raises:
        ValueError: no trials, or more successes than trials.
    """
    low, high = workers.statistics.wilson_interval(successes, trials)
    return Interval(successes / trials, low, high)


def success_rate(arrivals: Sequence[int], episodes: Sequence[int]) -> Interval:
    """Success rate over seeds: pooled, with Wilson's interval for the *effective* number of episodes.

    Where seeds differ more than chance allows, the pooled episodes are worth fewer: their number is divided by the design
    effect (Kish 1965), the variance of the rate seen between seeds over the one that independent episodes would have.

    Args:
        arrivals: of each seed.
        episodes: of each seed, all above 0.

    Raises:
        ValueError: no seeds, or lengths that differ.
    """
    arrived = np.asarray(arrivals, dtype=np.float64)
    driven = np.asarray(episodes, dtype=np.float64)
    if arrived.shape != driven.shape or not arrived.size:
        raise ValueError("arrivals and episodes need one number a seed")
    total = float(driven.sum())
    rate = float(arrived.sum()) / total
    effect = 1.0
    if arrived.size > 1 and 0.0 < rate < 1.0:
        deviations = arrived - rate * driven
        between = arrived.size / (arrived.size - 1) * float((deviations**2).sum()) / total**2
        effect = max(1.0, between / (rate * (1 - rate) / total))
    effective = total / effect
    return wilson_interval(rate * effective, effective)


def iqm(scores: FloatArray, axis: int = -1) -> FloatArray:
    """Interquartile mean: the mean of what is left after cutting floor(n / 4) scores off each end, along `axis`.

    Raises:
        ValueError: no scores.
    """
    count = scores.shape[axis]
    if count == 0:
        raise ValueError("an interquartile mean needs at least one score")
    cut = count // 4
    middle = np.take(np.sort(scores, axis=axis), np.arange(cut, count - cut), axis=axis)
    return np.asarray(middle.mean(axis=axis), dtype=np.float64)


def seeds_estimate(episodes: Sequence[FloatArray]) -> Interval:
    """Interquartile mean over seeds of each seed's mean over its episodes, with a two-stage bootstrap interval.

    One replicate draws seeds with replacement and, within every seed drawn, episodes with replacement. With one seed the
    interval is that of its own episodes and says nothing of other seeds.

    Args:
        episodes: the values of each seed's episodes; seeds may have different numbers of them, none may have none.

    Raises:
        ValueError: no seeds, or a seed without episodes.
    """
    if not episodes or any(values.size == 0 for values in episodes):
        raise ValueError("every seed needs at least one episode")
    generator = np.random.default_rng(_RANDOM_SEED)
    seeds = len(episodes)
    drawn = generator.integers(seeds, size=(_RESAMPLES, seeds))
    means = np.empty(drawn.shape)
    for index, values in enumerate(episodes):
        slots = drawn == index
        means[slots] = _resampled_means(values, int(slots.sum()), generator)
    value = float(iqm(np.array([values.mean() for values in episodes])))
    low, high = np.quantile(iqm(means), _QUANTILES)
    return Interval(value, min(float(low), value), max(float(high), value))


def curve_band(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bootstrap interval of the mean over seeds, at each point of a curve.

    Args:
        values: (seeds, points); nan where a seed has no value.

    Returns:
        low and high, (points,) each; nan where fewer than two seeds have a value.
    """
    present = np.isfinite(values)
    low = np.full(values.shape[1], np.nan)
    high = low.copy()
    # Points that the same seeds reach are resampled together: one curve's seeds stay together in each replicate.
    masks, group = np.unique(present, axis=1, return_inverse=True)
    for index, mask in enumerate(masks.T):
        count = int(mask.sum())
        if count < 2:
            continue
        drawn = np.random.default_rng(_RANDOM_SEED).integers(count, size=(_RESAMPLES, count))
        points = np.flatnonzero(group.ravel() == index)
        for part in np.array_split(points, -(-points.size * drawn.size // _MAX_DRAWS)):
            replicates = values[np.ix_(mask, part)][drawn].mean(axis=1)
            low[part], high[part] = np.quantile(replicates, _QUANTILES, axis=0)
    return low, high


def _resampled_means(values: FloatArray, count: int, generator: np.random.Generator) -> FloatArray:
    """`count` means of as many values as there are, drawn with replacement."""
    rows = max(1, _MAX_DRAWS // values.size)
    parts = [
        values[generator.integers(values.size, size=(min(rows, count - start), values.size))].mean(axis=1)
        for start in range(0, count, rows)
    ]
    return np.concatenate(parts) if parts else np.empty(0)
