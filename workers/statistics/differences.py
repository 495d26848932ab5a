"""Two configurations side by side: the difference of their means over seeds, and what it may be called."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from workers.statistics.intervals import CONFIDENCE, Floats, exact_interval, student_t
from workers.statistics.seeds import Band, rates_band

LEAST_SEEDS = 5
"""Below so many on either side nothing is called better, worse or equal."""

ONE_SIDED = 0.9
"""Confidence of an interval both of whose ends miss the truth in 5 %: that of two one-sided tests (Schuirmann 1987)."""

# Chances that differ by less are the same: what is added up has some eleven digits.
_ROUNDING = 1e-7

_TWO_SEEDS = "a difference needs two seeds on either side"

Word = Literal["higher", "lower", "equivalent", "not told"]
"""Of the first of two: direction, no difference that matters, or neither can be said."""


@dataclass(frozen=True, slots=True)
class Difference:
    """First less second, with two intervals.

    Attributes:
        value, low, high: with the 95 % interval, that of a direction.
        equivalent_low, equivalent_high: the 90 % interval, that of equivalence.
    """

    value: float
    low: float
    high: float
    equivalent_low: float
    equivalent_high: float

    @property
    def mirrored(self) -> "Difference":
        """Second less first."""
        return Difference(-self.value, -self.high, -self.low, -self.equivalent_high, -self.equivalent_low)

    def word(self, margin: float) -> Word:
        """What may be said of the first.

        Equivalence goes first: a difference that is sure and smaller than anybody cares for is none.

        Args:
            margin: differences up to this do not matter.
        """
        if -margin <= self.equivalent_low and self.equivalent_high <= margin:
            return "equivalent"
        if self.low > 0.0:
            return "higher"
        return "lower" if self.high < 0.0 else "not told"


@dataclass(frozen=True, slots=True)
class Rates:
    """A configuration's success: arrivals and episodes of each seed."""

    arrivals: Sequence[float]
    episodes: Sequence[float]


def difference_of_means(first: Sequence[float], second: Sequence[float]) -> Difference:
    """The difference of two means over independent seeds (Welch 1947).

    Raises:
        ValueError: fewer than two seeds on a side.
    """
    sides = [np.asarray(side, np.float64)[:, None] for side in (first, second)]
    return _difference(*(welch(sides[0], sides[1], confidence) for confidence in (CONFIDENCE, ONE_SIDED)))


def difference_of_rates(first: Rates, second: Rates) -> Difference:
    """The difference of two mean success rates, see `rates_difference`.

    Raises:
        ValueError: fewer than two seeds on a side.
    """
    if min(len(first.arrivals), len(second.arrivals)) < 2:
        raise ValueError(_TWO_SEEDS)

    (one, driven), (other, other_driven) = (arrival_rates(side) for side in (first, second))
    return _difference(*(rates_difference(one, driven, other, other_driven, level) for level in (CONFIDENCE, ONE_SIDED)))


def rates_difference(
    first: Floats, first_episodes: Floats, second: Floats, second_episodes: Floats, confidence: float = CONFIDENCE
) -> Band:
    """Difference of two mean rates with its interval at each point: the wider of two at either end.

    One is made of the intervals of the two rates (Zou and Donner 2008): how far either may lie on the side that matters is
    taken from its own interval, which knows the ceiling and the episodes. The other is Welch's, which one seed that fails
    keeps from a direction.

    Args:
        first: (seeds, points), 0 to 1.
        first_episodes: (seeds, points) behind each, or (seeds, 1).
        second: (seeds, points), of as many points.
        second_episodes: behind each.
        confidence: of the interval.
    """
    mean, low, high = rates_band(first, first_episodes, confidence)
    other, other_low, other_high = rates_band(second, second_episodes, confidence)
    value, welch_low, welch_high = welch(first, second, confidence)
    return (
        value,
        np.minimum(welch_low, value - np.hypot(mean - low, other_high - other)),
        np.maximum(welch_high, value + np.hypot(high - mean, other - other_low)),
    )


def rates_less_policy(rates: Floats, episodes: Floats, arrivals: int, driven: int, confidence: float = CONFIDENCE) -> Band:
    """Mean rate of the seeds less that of one very policy, which has none, with its interval at each point.

    The wider, at either end, of Student's t on the seeds' rates and of what is made of the interval over seeds and the exact
    one of the policy's episodes, as in `rates_difference`.

    Args:
        rates: (seeds, points), 0 to 1, of at least two seeds.
        episodes: (seeds, points) behind each, or (seeds, 1).
        arrivals: of the policy.
        driven: its episodes.
        confidence: of the interval.
    """
    mean, low, high = rates_band(rates, episodes, confidence)
    policy_low, policy_high = exact_interval(arrivals, driven, confidence)
    policy = arrivals / driven
    value = mean - policy
    reach = student_t(len(rates) - 1, confidence) * rates.std(axis=0, ddof=1) / len(rates) ** 0.5
    return (
        value,
        np.minimum(value - reach, value - np.hypot(mean - low, policy_high - policy)),
        np.maximum(value + reach, value + np.hypot(high - mean, policy - policy_low)),
    )


def welch(first: Floats, second: Floats, confidence: float = CONFIDENCE) -> Band:
    """Difference of two means with its interval at each point (Welch 1947, Satterthwaite 1946).

    Args:
        first: (seeds, points).
        second: (seeds, points), of as many points.
        confidence: of the interval.

    Raises:
        ValueError: fewer than two seeds on a side.
    """
    if min(len(first), len(second)) < 2:
        raise ValueError(_TWO_SEEDS)
    value = first.mean(axis=0) - second.mean(axis=0)
    freedom, error = welch_error(
        [side.var(axis=0, ddof=1) / len(side) for side in (first, second)], (len(first), len(second))
    )
    reach = student_t(freedom, confidence) * error
    return value, value - reach, value + reach


def welch_error(variances: Sequence[Floats], counts: Sequence[int]) -> tuple[Floats, Floats]:
    """Degrees of freedom and standard error of a difference (Satterthwaite 1946).

    Args:
        variances: of the two parts.
        counts: seeds that each is estimated from.
    """
    total = np.asarray(sum(variances), np.float64)
    shares = np.asarray(sum(part**2 / (count - 1) for part, count in zip(variances, counts, strict=True)), np.float64)
    # Seeds that agree to the last digit square to less than a float can hold.
    freedom = np.divide(total**2, shares, out=np.ones_like(total), where=shares > 0.0)
    return np.maximum(1.0, freedom), np.sqrt(total)


@cache
def fisher_exact(first: tuple[int, int], second: tuple[int, int]) -> float:
    """Two-sided p of two success rates being one (Fisher 1922): how often chance alone is at least as lopsided.

    Args:
        first: successes and trials.
        second: successes and trials.
    """
    (good, trials), (other_good, other_trials) = first, second
    total = good + other_good
    # Successes of the first with as many in all, and the logarithm of how often each comes up.
    mine = np.arange(max(0, total - other_trials), min(trials, total) + 1)
    factorials = np.concatenate(([0.0], np.cumsum(np.log(np.arange(1, max(trials, other_trials) + 1)))))

    def ways(of: int, chosen: NDArray[np.int64]) -> Floats:
        return np.asarray(factorials[of] - factorials[chosen] - factorials[of - chosen], np.float64)

    chances = ways(trials, mine) + ways(other_trials, total - mine)
    chances = np.exp(chances - chances.max())
    here = chances[good - mine[0]]
    return float(min(1.0, chances[chances <= here * (1 + _ROUNDING)].sum() / chances.sum()))


def arrival_rates(side: Rates) -> tuple[Floats, Floats]:
    """Rates and episodes, (seeds, 1) both."""
    episodes = np.asarray(side.episodes, np.float64)[:, None]
    return np.asarray(side.arrivals, np.float64)[:, None] / episodes, episodes


def _difference(sure: Band, one_sided: Band) -> Difference:
    value, low, high, inner_low, inner_high = (float(part[0]) for part in (*sure, *one_sided[1:]))
    return Difference(value, low, high, inner_low, inner_high)
