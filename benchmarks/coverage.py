"""How often the 95 % intervals of a few seeds hold the truth: success rates, other metrics, curves and differences.

Seeds are drawn from distributions that are known, 200 episodes each, 10,000 times; an interval covers if the mean of the
distribution (for an interquartile mean: its own) lies inside. Columns are numbers of seeds.

`before` is what the project did until commit a4df879: Wilson's interval on effective episodes, a two-stage bootstrap of
the interquartile mean, a bootstrap band around curves. They stand here, for the sake of this comparison alone.

    python -m benchmarks.coverage [--check]
"""

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from workers.statistics.differences import rates_difference, welch
from workers.statistics.intervals import exact_interval
from workers.statistics.seeds import means_band, rates_band

Floats = NDArray[np.float64]

SEEDS = (2, 3, 5, 10)
TRIALS = 10_000
CLAIMED = 0.93
"""Least coverage of a nominal 95 % wherever it is claimed at all."""
EPISODES = 200
_RESAMPLES = 2_000
_QUANTILES = (0.025, 0.975)
_Z = 1.959963984540054
# Of the plateau, at the points of a learning curve.
_RISE = (0.5, 1.0)


@dataclass(frozen=True, eq=False)
class Population:
    """Seeds that one could train.

    Attributes:
        name: in the table.
        described: how they are distributed.
        draw: values of that many seeds.
        mean: of all seeds.
        claimed: whether intervals are said to cover here.
    """

    name: str
    described: str
    draw: Callable[[np.random.Generator, tuple[int, ...]], Floats]
    mean: float
    claimed: bool = True

    @cached_property
    def iqm(self) -> float:
        """Interquartile mean of all seeds."""
        many = np.sort(self.draw(np.random.default_rng(0), (2_000_000,)))
        return float(many[many.size // 4 : -(many.size // 4)].mean())


def _two_ways(generator: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    return np.where(generator.random(shape) < 0.2, 0.1, 0.95)


RATES = (
    Population("equal", "all 80 %", lambda _, shape: np.full(shape, 0.8), 0.8),
    Population("normal", "75 %, deviation 6 points", lambda rng, shape: rng.normal(0.75, 0.06, shape).clip(0, 1), 0.75),
    Population("skewed", "Beta(9, 1): mean 90 %, skewness -1.5", lambda rng, shape: rng.beta(9.0, 1.0, shape), 0.9),
    Population("near the ceiling", "Beta(98.5, 1.5): mean 98.5 %", lambda rng, shape: rng.beta(98.5, 1.5, shape), 0.985),
    Population("bimodal", "95 %, one in five 10 %", _two_ways, 0.78, claimed=False),
)
"""Success rates of seeds."""

_SKEW = 0.3
METRICS = (
    Population("equal", "all 100", lambda _, shape: np.full(shape, 100.0), 100.0),
    Population("normal", "100, deviation 10", lambda rng, shape: rng.normal(100.0, 10.0, shape), 100.0),
    Population(
        "skewed",
        "log-normal, skewness 0.95",
        lambda rng, shape: 100.0 * rng.lognormal(-(_SKEW**2) / 2, _SKEW, shape),
        100.0,
    ),
    Population(
        "near the ceiling",
        "Beta(6, 2) of 133: skewness -0.7",
        lambda rng, shape: rng.beta(6.0, 2.0, shape) / 0.0075,
        100.0,
    ),
    Population("bimodal", "95, one in five 10", lambda rng, shape: 100.0 * _two_ways(rng, shape), 78.0, claimed=False),
    Population(
        "far skewed", "exponential: skewness 2", lambda rng, shape: rng.exponential(100.0, shape), 100.0, claimed=False
    ),
)
"""Steps, rewards and the like: the mean of a seed's episodes, whose deviation is `_WITHIN`."""
_WITHIN = 50.0

Limits = tuple[Floats, Floats]


def covered(limits: Limits, truth: float) -> float:
    """Share of the intervals that hold the truth."""
    low, high = limits
    return float(np.mean((low <= truth) & (truth <= high)))


# --- before ---


def wilson(successes: Floats, trials: Floats) -> Limits:
    """Wilson's interval (1927)."""
    share, z2 = successes / trials, _Z**2
    spread = _Z * np.sqrt(share * (1 - share) / trials + z2 / (4 * trials**2))
    centre, scale = share + z2 / (2 * trials), 1 + z2 / trials
    return (centre - spread) / scale, (centre + spread) / scale


def wilson_on_effective_episodes(arrivals: Floats) -> Limits:
    """Pooled arrivals, with the episodes divided by the design effect; arrivals (trials, seeds)."""
    seeds = arrivals.shape[1]
    total = float(seeds * EPISODES)
    rate = arrivals.sum(axis=1) / total
    deviations = arrivals - rate[:, None] * EPISODES
    between = seeds / (seeds - 1) * (deviations**2).sum(axis=1) / total**2
    chance = rate * (1 - rate) / total
    effect = np.maximum(1.0, np.divide(between, chance, out=np.ones_like(rate), where=chance > 0.0))
    return wilson(rate * total / effect, total / effect)


def iqm_bootstrap(means: Floats, errors: Floats) -> Limits:
    """Two-stage bootstrap of the interquartile mean over seeds.

    The mean of 200 resampled episodes is normal as far as a table shows; it is drawn as that.

    Args:
        means: (trials, seeds) of each seed's episodes.
        errors: (trials, seeds) standard errors of those means.
    """
    trials, seeds = means.shape
    generator = np.random.default_rng(20_210_830)
    drawn = generator.integers(seeds, size=(_RESAMPLES, seeds))
    noise = generator.normal(size=drawn.shape).astype(np.float32)
    cut = seeds // 4
    low, high = np.empty(trials), np.empty(trials)
    for part in np.array_split(np.arange(trials), -(-trials * drawn.size // 8_000_000)):
        replicates = means[part].astype(np.float32)[:, drawn] + errors[part].astype(np.float32)[:, drawn] * noise
        if cut:
            replicates = np.partition(replicates, (cut, seeds - cut - 1), axis=2)[:, :, cut : seeds - cut]
        low[part], high[part] = np.quantile(replicates.mean(axis=2), _QUANTILES, axis=1)
    return low, high


def bootstrap_band(values: Floats) -> Limits:
    """Bootstrap of the mean over seeds; values (trials, seeds)."""
    trials, seeds = values.shape
    drawn = np.random.default_rng(20_210_830).integers(seeds, size=(_RESAMPLES, seeds))
    weights = np.stack([np.bincount(row, minlength=seeds) for row in drawn], axis=1).astype(np.float32) / seeds
    low, high = np.empty(trials), np.empty(trials)
    for part in np.array_split(np.arange(trials), 10):
        low[part], high[part] = np.quantile(values[part].astype(np.float32) @ weights, _QUANTILES, axis=1)
    return low, high


# --- tables ---


def arrivals_of(population: Population, seeds: int, rise: float = 1.0, stream: int = 0) -> Floats:
    """Arrivals among `EPISODES` of each seed, (trials, seeds)."""
    generator = np.random.default_rng((seeds, stream))
    rates = rise * population.draw(generator, (TRIALS, seeds))
    return generator.binomial(EPISODES, rates).astype(np.float64)


def means_of(population: Population, seeds: int, stream: int = 0) -> tuple[Floats, Floats]:
    """Each seed's mean over its episodes and that mean's standard error, (trials, seeds) both."""
    generator = np.random.default_rng((seeds, stream))
    true = population.draw(generator, (TRIALS, seeds))
    means = true + generator.normal(0.0, _WITHIN / EPISODES**0.5, true.shape)
    # The deviation of 200 normal episodes, as a sample shows it.
    deviations = _WITHIN * np.sqrt(generator.chisquare(EPISODES - 1, true.shape) / (EPISODES - 1))
    return means, deviations / EPISODES**0.5


Coverage = Callable[[Population, int], float]


def success_before(population: Population, seeds: int) -> float:
    """Of Wilson on effective episodes."""
    return covered(wilson_on_effective_episodes(arrivals_of(population, seeds)), population.mean)


def success_now(population: Population, seeds: int) -> float:
    """Of t on the logit, with the episodes' exact interval inside."""
    return _of_rates(arrivals_of(population, seeds), population.mean)


def metric_before(population: Population, seeds: int) -> float:
    """Of the interquartile mean's bootstrap."""
    return covered(iqm_bootstrap(*means_of(population, seeds)), population.iqm)


def metric_now(population: Population, seeds: int) -> float:
    """Of t on the seeds' means."""
    means, errors = means_of(population, seeds)
    return covered(means_band(means.T, errors.T)[1:], population.mean)


def curve_before(population: Population, seeds: int) -> float:
    """Of the bootstrap band, at the points of a curve that rises to the population's success."""
    points = (
        covered(bootstrap_band(arrivals_of(population, seeds, rise)), rise * EPISODES * population.mean) for rise in _RISE
    )
    return sum(points) / len(_RISE)


def curve_now(population: Population, seeds: int) -> float:
    """Of the band of t on the logit."""
    points = (_of_rates(arrivals_of(population, seeds, rise), rise * population.mean) for rise in _RISE)
    return sum(points) / len(_RISE)


def _of_rates(arrivals: Floats, mean: float) -> float:
    return covered(rates_band(arrivals.T / EPISODES, np.full((1, 1), float(EPISODES)))[1:], mean)


def rate_difference(population: Population, seeds: int) -> float:
    """Of the difference of two configurations that are alike, in success."""
    episodes = np.full((1, 1), float(EPISODES))
    first, second = (arrivals_of(population, seeds, stream=one).T / EPISODES for one in (1, 2))
    return covered(rates_difference(first, episodes, second, episodes)[1:], 0.0)


def mean_difference(population: Population, seeds: int) -> float:
    """Of the difference of two configurations that are alike, in another metric."""
    first, second = (means_of(population, seeds, stream=one)[0].T for one in (1, 2))
    return covered(welch(first, second)[1:], 0.0)


def single_policy() -> tuple[float, float]:
    """Least coverage of one policy's success on `EPISODES`, of Wilson's interval and of the exact one: no simulation."""
    arrivals = np.arange(EPISODES + 1, dtype=np.float64)
    rates = np.linspace(0.5, 0.999, 500)
    chances = binom.pmf(arrivals, EPISODES, rates[:, None])
    least = []
    for low, high in (wilson(arrivals, np.full_like(arrivals, EPISODES)), exact_interval(arrivals, EPISODES)):
        inside = (low <= rates[:, None]) & (rates[:, None] <= high)
        least.append(float((chances * inside).sum(axis=1).min()))
    return least[0], least[1]


def table(title: str, populations: tuple[Population, ...], columns: dict[str, Coverage]) -> list[str]:
    """Prints coverage in per cent, a row a population.

    Returns:
        What is claimed and does not hold.
    """
    heads = [f"{name}, {seeds}" for name in columns for seeds in SEEDS]
    print(f"\n### {title}\n\n| seeds are | | {' | '.join(heads)} |\n|---|---|{'---|' * len(heads)}")
    missed = []
    for population in populations:
        cells = []
        for name, coverage in columns.items():
            for seeds in SEEDS:
                share = coverage(population, seeds)
                cells.append(f"{100 * share:.1f}")
                if name == "now" and population.claimed and share < CLAIMED:
                    missed.append(f"{title}, {population.name}, {seeds} seeds: {share:.1%}")
        print(f"| {population.name} | {population.described} | {' | '.join(cells)} |", flush=True)
    return missed


def main() -> None:
    """Prints all tables; with `--check` fails where coverage is below what is claimed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help=f"fail below {CLAIMED:.2f} where that is claimed")
    check = parser.parse_args().check
    started = time.perf_counter()
    missed = [
        *table("Success rates", RATES, {"before": success_before, "now": success_now}),
        *table("Other metrics", METRICS, {"before": metric_before, "now": metric_now}),
        *table("Curves of success", RATES, {"before": curve_before, "now": curve_now}),
        *table("Differences of success", RATES, {"now": rate_difference}),
        *table("Differences of other metrics", METRICS, {"now": mean_difference}),
    ]
    before, now = single_policy()
    print(
        f"\nOne policy on {EPISODES} episodes, least coverage for rates of 50 to 99.9 %: before {before:.1%}, now {now:.1%}"
    )
    print(f"\n{time.perf_counter() - started:.0f} s")
    if check and missed:
        sys.exit("\n".join(["Below what is claimed:", *missed]))


if __name__ == "__main__":
    main()
