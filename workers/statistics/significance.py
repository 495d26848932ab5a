"""Tests beside the intervals: of a difference over seeds, of two sets of policies on the same scenarios, of many at once.

The unit of a test is what it speaks of. Over seeds it speaks of all seeds that one could train; paired over scenarios, of
these very policies wherever scenarios are drawn as the suite's were.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from workers.statistics.differences import Rates, arrival_rates, rates_difference, rates_less_policy, welch
from workers.statistics.intervals import Floats

LEAST_P = 1e-9
"""What is less is this: nobody believes a model so far."""

# Of nine decades: p is found to a thousandth of itself.
_HALVINGS = 14

# Multiplications of the exact distribution of signs; beyond them its normal approximation differs in no digit that is shown.
_EXACT_WORK = 4_000_000


@dataclass(frozen=True, slots=True)
class Paired:
    """Two sets of policies on the same scenarios.

    Attributes:
        scenarios: that both were measured on.
        more, less: of them, on how many the first has the larger value, and the smaller.
        p: two-sided, of the first's values and the second's being exchangeable in each scenario.
    """

    scenarios: int
    more: int
    less: int
    p: float


def p_of_rates(first: Rates, second: Rates) -> float:
    """Two-sided p of two mean success rates being one: at 1 - p the interval of `rates_difference` just touches zero."""
    (one, driven), (other, other_driven) = arrival_rates(first), arrival_rates(second)
    return _least_level(lambda confidence: rates_difference(one, driven, other, other_driven, confidence)[1:])


def p_of_seeds_and_policy(seeds: Rates, arrivals: int, driven: int) -> float:
    """Two-sided p of the mean success rate of seeds being that of one very policy, see `rates_less_policy`.

    Args:
        seeds: at least two.
        arrivals: of the policy.
        driven: its episodes.
    """
    rates, episodes = arrival_rates(seeds)
    return _least_level(lambda confidence: rates_less_policy(rates, episodes, arrivals, driven, confidence)[1:])


def p_of_means(first: Sequence[float], second: Sequence[float]) -> float:
    """Two-sided p of two means over independent seeds being one (Welch 1947)."""
    one, other = (np.asarray(side, np.float64)[:, None] for side in (first, second))
    return _least_level(lambda confidence: welch(one, other, confidence)[1:])


def _least_level(ends: Callable[[float], tuple[Floats, Floats]]) -> float:
    """The least level at which an interval leaves out zero; intervals widen with their confidence."""

    def outside(log_level: float) -> float:
        low, high = (float(end[0]) for end in ends(1.0 - 10.0**log_level))
        return max(low, -high)

    sure, unsure = math.log10(LEAST_P), math.log10(1.0 - LEAST_P)
    if outside(sure) > 0.0:
        return LEAST_P
    if outside(unsure) <= 0.0:
        return 1.0
    for _ in range(_HALVINGS):
        middle = (sure + unsure) / 2
        sure, unsure = (sure, middle) if outside(middle) > 0.0 else (middle, unsure)
    return float(10.0**unsure)


def paired_rates(first: Floats, second: Floats) -> Paired:
    """The exact paired randomisation test (Fisher 1935) of arrivals, scenario by scenario.

    In each scenario the two sides' shares of seeds that arrived might as well be the other way round. With a seed on either
    side it is McNemar's exact test.

    Args:
        first: (seeds, scenarios), 1 where a seed arrived and 0 where not.
        second: (seeds, scenarios), of as many scenarios.
    """
    whole = math.lcm(len(first), len(second))
    arrived = [np.rint(side.sum(axis=0) * (whole // len(side))).astype(np.int64) for side in (first, second)]
    return _paired(arrived[0] - arrived[1])


def paired_values(first: Floats, second: Floats) -> Paired | None:
    """Wilcoxon's signed-rank test (1945) of the sides' means, scenario by scenario.

    Args:
        first: (seeds, scenarios); nan where a seed has no value. Scenarios without one on either side are left out.
        second: (seeds, scenarios), of as many scenarios.

    Returns:
        None where no scenario is left.
    """
    means = [_means(side) for side in (first, second)]
    both = np.isfinite(means[0]) & np.isfinite(means[1])
    if not both.any():
        return None
    # Steps are whole: what differs by rounding is the same.
    apart = np.round(means[0][both] - means[1][both], 9)
    kinds, place, counts = np.unique(np.abs(apart[apart != 0.0]), return_inverse=True, return_counts=True)
    # Twice the middle rank of equals, so that it is whole.
    ranks = (2 * np.cumsum(counts) - counts + 1)[place] if kinds.size else np.zeros(0, np.int64)
    signed = np.zeros(apart.size, np.int64)
    signed[apart != 0.0] = ranks * np.sign(apart[apart != 0.0]).astype(np.int64)
    return _paired(signed)


def holm(ps: Sequence[float]) -> list[float]:
    """The same p after so many tests (Holm 1979): below 5 %, none of them was chance alone but in one family of twenty."""
    adjusted = [0.0] * len(ps)
    largest = 0.0
    for rank, index in enumerate(sorted(range(len(ps)), key=ps.__getitem__)):
        largest = max(largest, min(1.0, (len(ps) - rank) * ps[index]))
        adjusted[index] = largest
    return adjusted


def _paired(apart: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Paired:
    """Of whole differences, a scenario each."""
    return Paired(apart.size, int((apart > 0).sum()), int((apart < 0).sum()), max(LEAST_P, _p_of_signs(apart)))


def _p_of_signs(apart: np.ndarray[tuple[int], np.dtype[np.int64]]) -> float:
    """How often signs thrown by coins make a sum as far from zero: exact, or normal where that is long work."""
    sizes = np.abs(apart[apart != 0])
    if not sizes.size:
        return 1.0
    sizes = sizes // np.gcd.reduce(sizes)
    total, reached = int(sizes.sum()), abs(int((np.sign(apart[apart != 0]) * sizes).sum()))
    if sizes.size * total > _EXACT_WORK:
        return math.erfc(reached / math.sqrt(2.0 * float((sizes.astype(np.float64) ** 2).sum())))
    # Chances of each sum of the sizes that came up positive.
    chances = np.zeros(total + 1)
    chances[0] = 1.0
    for size in sizes.tolist():
        chances *= 0.5
        chances[size:] += chances[:-size].copy()
    sums = np.abs(2 * np.arange(total + 1) - total)
    return float(min(1.0, chances[sums >= reached].sum()))


def _means(side: Floats) -> Floats:
    present = np.isfinite(side)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(present, side, 0.0).sum(axis=0) / present.sum(axis=0), np.float64)
