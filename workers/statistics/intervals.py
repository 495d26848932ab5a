"""Quantiles and the exact interval of a share: what all intervals are made of."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

CONFIDENCE = 0.95
"""Of every interval that is shown."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A number with its interval, low <= value <= high."""

    value: float
    low: float
    high: float


def student_t(freedom: ArrayLike, confidence: float = CONFIDENCE) -> Floats:
    """Two-sided quantile of Student's t: 12.706 for 1 degree of freedom, 2.776 for 4, 1.960 without end.

    Args:
        freedom: degrees of freedom, above 0; need not be whole.
        confidence: share of the distribution between minus and plus the quantile.
    """
    from scipy.special import stdtrit

    return np.asarray(stdtrit(freedom, (1 + confidence) / 2), np.float64)


def exact_interval(successes: ArrayLike, trials: ArrayLike, confidence: float = CONFIDENCE) -> tuple[Floats, Floats]:
    """Interval of the probability behind independent trials that covers whatever it is (Clopper and Pearson 1934).

    Neither number need be whole: rates over drives are means.

    Returns:
        low and high, with low <= successes / trials <= high, as many as there are counts.

    Raises:
        ValueError: there were no trials, or more successes than trials.
    """
    from scipy.special import betaincinv

    good, all_ = np.broadcast_arrays(np.asarray(successes, np.float64), np.asarray(trials, np.float64))
    if not ((good >= 0) & (good <= all_) & (all_ > 0)).all():
        raise ValueError(f"{good.tolist()} successes of {all_.tolist()} trials have no interval")
    tail = (1 - confidence) / 2
    bad = all_ - good
    low = np.where(good > 0, betaincinv(np.where(good > 0, good, 1.0), bad + 1, tail), 0.0)
    high = np.where(bad > 0, betaincinv(good + 1, np.where(bad > 0, bad, 1.0), 1 - tail), 1.0)
    # At 0 and 1 rounding could leave the share a hair outside its own interval.
    return np.minimum(low, good / all_), np.maximum(high, good / all_)


def upper_bound(successes: int, trials: int, confidence: float = CONFIDENCE) -> float:
    """What the probability is at most, one-sided and exact: 0 of 5 leave 45 % open, 0 of 59 leave 5 %.

    Raises:
        ValueError: there were no trials, or more successes than trials.
    """
    # The upper end of a two-sided interval with as much in its tail.
    return float(exact_interval(successes, trials, 2 * confidence - 1)[1])
