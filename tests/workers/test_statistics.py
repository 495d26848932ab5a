"""Intervals and tests against figures from the literature, or worked by hand."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workers.statistics import difference_interval, fisher_exact, mean_interval, student_t_95, wilson_interval


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        (81, 263, 0.2553, 0.3662),  # Newcombe (1998), table I, method 3
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
        (90, 90, 0.9591, 1.0000),  # the paper's 90 of 90
    ],
)
def test_interval(successes: int, trials: int, low: float, high: float) -> None:
    assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=5e-5)


@given(trials=st.floats(1e-3, 1e6), share=st.floats(0, 1))
def test_interval_holds_its_rate_and_mirrors(trials: float, share: float) -> None:
    successes = share * trials
    low, high = wilson_interval(successes, trials)
    _, mirrored_high = wilson_interval(trials - successes, trials)
    assert 0 <= low <= successes / trials <= high <= 1
    assert low == pytest.approx(1 - mirrored_high, abs=1e-9)


@pytest.mark.parametrize(("successes", "trials"), [(0, 0), (5, 4), (2, 1), (-1, 5)])
def test_impossible_counts_are_refused(successes: int, trials: int) -> None:
    with pytest.raises(ValueError, match="no interval"):
        wilson_interval(successes, trials)


@pytest.mark.parametrize(
    ("freedom", "quantile"), [(1, 12.7062), (2, 4.3027), (4, 2.7764), (8, 2.3060), (30, 2.0423), (1e4, 1.9602)]
)
def test_student_t_as_tabled(freedom: float, quantile: float) -> None:
    assert student_t_95(freedom) == pytest.approx(quantile, abs=2e-4)


def test_mean_interval() -> None:
    """1 to 5: deviation sqrt(2.5), error sqrt(2.5 / 5), times 2.7764."""
    assert mean_interval([1, 2, 3, 4, 5]) == pytest.approx((3.0, 3.0 - 1.9632, 3.0 + 1.9632), abs=1e-3)
    assert mean_interval([7.0]) == (7.0, 7.0, 7.0)


def test_difference_interval() -> None:
    """Equal variances of 2.5 over five seeds each: error 1, 8 degrees of freedom, 2.3060 either way."""
    assert difference_interval([2, 3, 4, 5, 6], [1, 2, 3, 4, 5]) == pytest.approx((1.0, -1.3060, 3.3060), abs=1e-3)
    # One side without spread: only the other's 4 degrees of freedom are left, and its error of sqrt(0.5).
    assert difference_interval([1, 2, 3, 4, 5], [0] * 5) == pytest.approx((3.0, 1.0368, 4.9632), abs=1e-3)
    assert difference_interval([1.0] * 5, [0.5] * 5) == (0.5, 0.5, 0.5)
    with pytest.raises(ValueError, match="two seeds"):
        difference_interval([1.0], [1.0, 2.0])


seeds = st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=8)


@given(seeds, seeds)
def test_difference_interval_holds_its_difference_and_mirrors(first: list[float], second: list[float]) -> None:
    difference, low, high = difference_interval(first, second)
    assert low <= difference <= high
    assert difference_interval(second, first) == pytest.approx((-difference, -high, -low))


@pytest.mark.parametrize(
    ("first", "second", "p"),
    [
        ((3, 4), (1, 4), 0.4857),  # the lady tasting tea
        ((8, 10), (1, 6), 0.0350),
        ((59, 63), (63, 74), 0.1692),  # the paper's DDPG against its advanced reward
        ((5, 5), (3, 3), 1.0),
    ],
)
def test_fisher_exact(first: tuple[int, int], second: tuple[int, int], p: float) -> None:
    assert fisher_exact(first, second) == pytest.approx(p, abs=5e-5)
    assert fisher_exact(second, first) == pytest.approx(p, abs=5e-5)
