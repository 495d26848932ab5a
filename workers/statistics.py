"""How sure a measured number is: success rates, means over seeds, and differences between them (NumPy only)."""

import math
from collections.abc import Sequence

import numpy as np

_Z_95 = 1.959963984540054
"""Two-sided 95 % quantile of the normal distribution."""


def wilson_interval(successes: float, trials: float) -> tuple[float, float]:
    """95 % interval of a success probability (Wilson 1927); honest at 0 % and 100 %, where the textbook's is a point.

    Neither number need be whole: episodes that depend on each other count as fewer.

    Returns:
        low and high, with low <= successes / trials <= high.

    Raises:
        ValueError: there were no trials, or more successes than trials.
    """
    if not 0 <= successes <= trials or trials <= 0:
        raise ValueError(f"{successes} successes of {trials} trials have no interval")
    share, z2 = successes / trials, _Z_95 * _Z_95
    centre = share + z2 / (2 * trials)
    spread = _Z_95 * math.sqrt(share * (1 - share) / trials + z2 / (4 * trials * trials))
    scale = 1 + z2 / trials
    # At 0 and 1 rounding could leave the share a hair outside its own interval.
    return max(0.0, min((centre - spread) / scale, share)), min(1.0, max((centre + spread) / scale, share))


def student_t_95(freedom: float) -> float:
    """Two-sided 95 % quantile of Student's t; 12.706 for 1 degree of freedom, 2.776 for 4, 1.960 without end.

    With t = sqrt(freedom) tan(angle) the density is cos(angle) ** (freedom - 1): smooth on a bounded range, so that adding
    it up is exact to four digits.

    Args:
        freedom: degrees of freedom, at least 1; need not be whole.
    """
    angles = np.linspace(0.0, np.pi / 2, 100_001)
    density = np.cos(angles).clip(0.0) ** (freedom - 1.0)
    covered = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2)])
    return float(math.sqrt(freedom) * math.tan(np.interp(0.95, covered / covered[-1], angles)))


def mean_interval(values: Sequence[float]) -> tuple[float, float, float]:
    """The mean of independent seeds and its 95 % interval (Student 1908).

    Honest with five seeds, where a percentile bootstrap covers about 84 %. One value is its own interval.

    Returns:
        mean, low, high.
    """
    mean = float(np.mean(values))
    if len(values) < 2:
        return mean, mean, mean
    reach = student_t_95(len(values) - 1) * float(np.std(values, ddof=1)) / math.sqrt(len(values))
    return mean, mean - reach, mean + reach


def difference_interval(first: Sequence[float], second: Sequence[float]) -> tuple[float, float, float]:
    """The difference of two means over independent seeds, first less second, and its 95 % interval (Welch 1947).

    Returns:
        difference, low, high.

    Raises:
        ValueError: fewer than two seeds on a side.
    """
    if min(len(first), len(second)) < 2:
        raise ValueError("a difference needs two seeds on either side")
    difference = float(np.mean(first) - np.mean(second))
    parts = [float(np.var(values, ddof=1)) / len(values) for values in (first, second)]
    if sum(parts) == 0.0:
        return difference, difference, difference
    shares = sum(part**2 / (len(values) - 1) for part, values in zip(parts, (first, second), strict=True))
    # Seeds that agree to the last digit square to less than a float can hold.
    freedom = sum(parts) ** 2 / shares if shares > 0.0 else 1.0
    reach = student_t_95(max(1.0, freedom)) * math.sqrt(sum(parts))
    return difference, difference - reach, difference + reach


def fisher_exact(first: tuple[int, int], second: tuple[int, int]) -> float:
    """Two-sided p of two success rates being one (Fisher 1922): how often chance alone is at least as lopsided.

    Args:
        first: successes and trials.
        second: successes and trials.
    """
    (a, n), (b, m) = first, second
    successes, ways = a + b, math.comb(n + m, a + b)

    def probability(k: int) -> float:
        return math.comb(n, k) * math.comb(m, successes - k) / ways

    # Equally likely tables may differ in their last digit.
    limit = probability(a) * (1 + 1e-9)
    tables = (probability(k) for k in range(max(0, successes - m), min(n, successes) + 1))
    return min(1.0, sum(p for p in tables if p <= limit))
