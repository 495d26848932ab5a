"""Rates, interquartile means and their intervals, worked by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.statistics import curve_band, iqm, seeds_estimate, success_rate, wilson_interval


def test_wilson_interval_of_8_in_10() -> None:
    # z^2 = 3.8415: centre (0.8 + 0.19207) / 1.38415 = 0.71674, half 1.95996 / 1.38415 * sqrt(0.016 + 0.0096036) = 0.22657.
    interval = wilson_interval(8, 10)

    assert interval.value == 0.8
    assert interval.low == pytest.approx(0.49017, abs=1e-5)
    assert interval.high == pytest.approx(0.94332, abs=1e-5)


def test_seeds_that_agree_are_pooled() -> None:
    assert success_rate([90, 90, 90], [100, 100, 100]) == wilson_interval(270, 300)


def test_seeds_that_differ_more_than_chance_are_worth_fewer_episodes() -> None:
    # Rate 150/200 = 0.75. Variance between seeds: 2/1 * ((100-75)^2 + (50-75)^2) / 200^2 = 0.0625; of independent episodes:
    # 0.1875 / 200 = 0.0009375. Design effect 66.67, so 200 episodes count as 3.
    interval = success_rate([100, 50], [100, 100])

    assert interval == wilson_interval(2.25, 3)
    assert interval.low < 0.35


def test_iqm_cuts_a_quarter_off_each_end() -> None:
    # rliable's definition, scipy.stats.trim_mean(scores, 0.25): of 8 scores the middle 4, of 5 the middle 3, of 3 all.
    assert iqm(np.array([100.0, 1, 2, 3, 4, 5, 6, -50])) == pytest.approx((2 + 3 + 4 + 5) / 4)
    assert iqm(np.array([0.0, 10, 20, 30, 1000])) == pytest.approx(20)
    assert iqm(np.array([1.0, 2, 6])) == pytest.approx(3)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40))
def test_iqm_lies_within_its_scores_whatever_their_order(scores: list[float]) -> None:
    value = float(iqm(np.array(scores)))

    assert min(scores) - 1e-6 <= value <= max(scores) + 1e-6
    assert float(iqm(np.array(scores[::-1]))) == pytest.approx(value)


def test_seeds_estimate_is_the_iqm_of_the_seeds_means() -> None:
    # Means 10, 20, 30, 40, 1000: the middle three.
    samples = [np.array([mean - 1.0, mean + 1.0]) for mean in (10, 20, 30, 40, 1000)]

    assert seeds_estimate(samples).value == pytest.approx(30)


def test_seeds_without_spread_leave_no_interval() -> None:
    interval = seeds_estimate([np.full(20, 7.0), np.full(30, 7.0)])

    assert (interval.value, interval.low, interval.high) == (7.0, 7.0, 7.0)


def test_the_interval_of_one_seed_is_that_of_its_mean() -> None:
    # The mean of 400 episodes of unit variance has a standard error of 0.05; 1.96 of those either side.
    values = np.random.default_rng(1).normal(size=400)
    interval = seeds_estimate([(values - values.mean()) / values.std()])

    assert interval.low == pytest.approx(-0.098, abs=0.015)
    assert interval.high == pytest.approx(0.098, abs=0.015)


def test_many_episodes_of_two_seeds_do_not_hide_that_the_seeds_differ() -> None:
    interval = seeds_estimate([np.zeros(5_000), np.ones(5_000)])

    assert (interval.value, interval.low, interval.high) == (0.5, 0.0, 1.0)


def test_the_same_data_give_the_same_interval() -> None:
    samples = [np.random.default_rng(seed).normal(size=50) for seed in range(5)]

    assert seeds_estimate(samples) == seeds_estimate(samples)


def test_an_estimate_needs_episodes_of_every_seed() -> None:
    with pytest.raises(ValueError, match="at least one episode"):
        seeds_estimate([np.ones(3), np.zeros(0)])


def test_curve_band_only_where_two_seeds_have_values() -> None:
    values = np.array([[1.0, 1.0, np.nan], [3.0, np.nan, np.nan]])
    low, high = curve_band(values)

    # Two seeds resampled: both 1 in a quarter of the replicates, both 3 in another.
    assert (low[0], high[0]) == (1.0, 3.0)
    assert np.isnan(low[1:]).all()
    assert np.isnan(high[1:]).all()


def test_curve_band_equals_the_bootstrap_of_each_point() -> None:
    generator = np.random.default_rng(3)
    values = generator.normal(size=(5, 60))
    low, high = curve_band(values)
    drawn = values[generator.integers(5, size=(20_000, 5)), 17]
    expected = np.quantile(drawn.mean(axis=1), (0.025, 0.975))

    assert low[17] == pytest.approx(expected[0], abs=0.1)
    assert high[17] == pytest.approx(expected[1], abs=0.1)
