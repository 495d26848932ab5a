"""The intervals hold the truth as often as docs/statistics.md claims; the benchmark adds what they replaced."""

import pytest

from benchmarks.coverage import (
    CLAIMED,
    METRICS,
    RATES,
    SEEDS,
    Population,
    curve_now,
    mean_difference,
    metric_now,
    rate_difference,
    single_policy,
    success_before,
    success_now,
)

claimed_rates = pytest.mark.parametrize("population", [one for one in RATES if one.claimed], ids=lambda one: one.name)
claimed_metrics = pytest.mark.parametrize("population", [one for one in METRICS if one.claimed], ids=lambda one: one.name)
numbers = pytest.mark.parametrize("seeds", SEEDS)


@claimed_rates
@numbers
def test_success_and_its_curves_and_differences(population: Population, seeds: int) -> None:
    assert success_now(population, seeds) >= CLAIMED
    assert curve_now(population, seeds) >= CLAIMED
    assert rate_difference(population, seeds) >= CLAIMED


@claimed_metrics
@numbers
def test_other_metrics_and_their_differences(population: Population, seeds: int) -> None:
    assert metric_now(population, seeds) >= CLAIMED
    assert mean_difference(population, seeds) >= CLAIMED


def test_one_policy_is_covered_whatever_its_rate() -> None:
    before, now = single_policy()
    assert before < CLAIMED
    assert now >= 0.95


def test_what_the_intervals_replaced_did_not_cover() -> None:
    """Five seeds that differ as normal ones do: so a test of this kind can fail."""
    normal = next(one for one in RATES if one.name == "normal")
    assert success_before(normal, 5) < 0.9
