"""Figures over seeds as the page writes them."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import f

from workers.reproduction.results import SeedResult, rate_spread
from workers.statistics.differences import Difference, Rates
from workers.statistics.seeds import mean_interval
from workers.statistics.wording import Scale, effect, equivalence, untold


def rates(seeds: Sequence[SeedResult]) -> Rates:
    """Of a training's seeds, to be compared."""
    attempts = [seed.attempts for seed in seeds]
    return Rates([seed.measured.success * n for seed, n in zip(seeds, attempts, strict=True)], attempts)


def rate(seeds: Sequence[SeedResult]) -> str:
    """Mean success in per cent, with its interval."""
    spread = rate_spread([seed.measured.success for seed in seeds], [seed.attempts for seed in seeds])
    assert spread.low is not None
    assert spread.high is not None
    return f"**{100 * spread.mean:.1f}** [{100 * spread.low:.1f}, {100 * spread.high:.1f}]"


def each(seeds: Sequence[SeedResult]) -> str:
    """Success of each seed in per cent."""
    return ", ".join(f"{100 * seed.measured.success:.1f}" for seed in seeds)


def mean(values: Sequence[float], factor: float = 1.0) -> str:
    """A mean over seeds with Student's t."""
    interval = mean_interval(values)
    decimals = 1 if factor > 1.0 else 2
    low, high = factor * interval.low, factor * interval.high
    return f"**{factor * interval.value:.{decimals}f}** [{low:.{decimals}f}, {high:.{decimals}f}]"


def told(scale: Scale, difference: Difference, seeds: int) -> str:
    """What may be said of a difference, in a sentence."""
    match difference.word(scale.margin):
        case "equivalent":
            return equivalence(scale, difference)
        case "not told":
            return untold(scale, difference, seeds)
        case _:
            return f"{effect(scale, difference)}."


def ratio_of_spreads(first: Sequence[SeedResult], second: Sequence[SeedResult]) -> str:
    """The ratio of two standard deviations with its 95 % interval (the F distribution, seeds as if normal)."""
    sides = [np.array([one.measured.success for one in side]) for side in (first, second)]
    ratio = float(np.var(sides[0], ddof=1) / np.var(sides[1], ddof=1))
    freedom = [len(side) - 1 for side in sides]
    low, high = (ratio / float(f.ppf(end, *freedom)) for end in (0.975, 0.025))
    return f"{ratio**0.5:.2f} times, 95 % interval [{low**0.5:.2f}, {high**0.5:.2f}]."
