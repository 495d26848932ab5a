"""How often the 95 % intervals of a few seeds hold the truth: success rates, other metrics, curves and differences.

Seeds are drawn from distributions that are known, 200 episodes each, 10,000 times; an interval covers if the mean of the
distribution (for an interquartile mean: its own) lies inside. Columns are numbers of seeds.

`before` is what the project did until commit a4df879: Wilson's interval on effective episodes, a two-stage bootstrap of
the interquartile mean, a bootstrap band around curves. They stand here, for the sake of this comparison alone.

    python -m benchmarks.coverage
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SEEDS = (2, 3, 5, 10)
TRIALS = 10_000
EPISODES = 200
_RESAMPLES = 2_000
_QUANTILES = (0.025, 0.975)
_Z = 1.959963984540054
# Of the plateau, at the points of a learning curve.
_RISE = (0.5, 1.0)


@dataclass(frozen=True)
class Population:
    """Seeds that one could train.

    Attributes:
        name: in the table.
        described: how they are distributed.
        draw: values of that many seeds.
        mean: of all seeds.
        iqm: interquartile mean of all seeds.
    """

    name: str
    described: str
    draw: Callable[[np.random.Generator, tuple[int, ...]], Floats]
    mean: float
    iqm: float


def _population(
    name: str, described: str, draw: Callable[[np.random.Generator, tuple[int, ...]], Floats], mean: float
) -> Population:
    many = np.sort(draw(np.random.default_rng(0), (2_000_000,)))
    return Population(name, described, draw, mean, float(many[many.size // 4 : -(many.size // 4)].mean()))


def _two_ways(generator: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    return np.where(generator.random(shape) < 0.2, 0.1, 0.95)


RATES = (
    _population("equal", "all 80 %", lambda _, shape: np.full(shape, 0.8), 0.8),
    _population("normal", "75 %, deviation 6 points", lambda rng, shape: rng.normal(0.75, 0.06, shape).clip(0, 1), 0.75),
    _population("skewed", "Beta(9, 1): mean 90 %, skewness -1.5", lambda rng, shape: rng.beta(9.0, 1.0, shape), 0.9),
    _population("near the ceiling", "Beta(98.5, 1.5): mean 98.5 %", lambda rng, shape: rng.beta(98.5, 1.5, shape), 0.985),
    _population("bimodal", "95 %, one in five 10 %", _two_ways, 0.78),
)
"""Success rates of seeds."""

_SKEW = 0.3
METRICS = (
    _population("equal", "all 100", lambda _, shape: np.full(shape, 100.0), 100.0),
    _population("normal", "100, deviation 10", lambda rng, shape: rng.normal(100.0, 10.0, shape), 100.0),
    _population(
        "skewed",
        "log-normal, skewness 0.95",
        lambda rng, shape: 100.0 * rng.lognormal(-(_SKEW**2) / 2, _SKEW, shape),
        100.0,
    ),
    _population(
        "near the ceiling",
        "150 Beta(5, 1.5): skewness -0.8",
        lambda rng, shape: 150.0 * rng.beta(5.0, 1.5, shape),
        150 * 5 / 6.5,
    ),
    _population("bimodal", "95, one in five 10", lambda rng, shape: 100.0 * _two_ways(rng, shape), 78.0),
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


def arrivals_of(population: Population, seeds: int, rise: float = 1.0) -> Floats:
    """Arrivals among `EPISODES` of each seed, (trials, seeds)."""
    generator = np.random.default_rng(seeds)
    rates = rise * population.draw(generator, (TRIALS, seeds))
    return generator.binomial(EPISODES, rates).astype(np.float64)


def means_of(population: Population, seeds: int) -> tuple[Floats, Floats]:
    """Each seed's mean over its episodes and that mean's standard error, (trials, seeds) both."""
    generator = np.random.default_rng(seeds)
    true = population.draw(generator, (TRIALS, seeds))
    means = true + generator.normal(0.0, _WITHIN / EPISODES**0.5, true.shape)
    # The deviation of 200 normal episodes, as a sample shows it.
    deviations = _WITHIN * np.sqrt(generator.chisquare(EPISODES - 1, true.shape) / (EPISODES - 1))
    return means, deviations / EPISODES**0.5


Coverage = Callable[[Population, int], float]


def success_before(population: Population, seeds: int) -> float:
    """Of Wilson on effective episodes."""
    return covered(wilson_on_effective_episodes(arrivals_of(population, seeds)), population.mean)


def metric_before(population: Population, seeds: int) -> float:
    """Of the interquartile mean's bootstrap."""
    return covered(iqm_bootstrap(*means_of(population, seeds)), population.iqm)


def curve_before(population: Population, seeds: int) -> float:
    """Of the bootstrap band, at the points of a curve that rises to the population's success."""
    points = (
        covered(bootstrap_band(arrivals_of(population, seeds, rise)), rise * EPISODES * population.mean) for rise in _RISE
    )
    return sum(points) / len(_RISE)


def table(title: str, populations: tuple[Population, ...], columns: dict[str, Coverage]) -> None:
    """Prints coverage in per cent, a row a population."""
    heads = [f"{name}, {seeds}" for name in columns for seeds in SEEDS]
    print(f"\n### {title}\n\n| seeds are | | {' | '.join(heads)} |\n|---|---|{'---|' * len(heads)}")
    for population in populations:
        cells = [f"{100 * coverage(population, seeds):.1f}" for coverage in columns.values() for seeds in SEEDS]
        print(f"| {population.name} | {population.described} | {' | '.join(cells)} |", flush=True)


def main() -> None:
    """Prints all tables."""
    started = time.perf_counter()
    table("Success rates", RATES, {"before": success_before})
    table("Other metrics", METRICS, {"before": metric_before})
    table("Curves of success", RATES, {"before": curve_before})
    print(f"\n{time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
