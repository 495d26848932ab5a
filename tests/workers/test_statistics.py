"""Wilson's interval against figures from the literature."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workers.statistics import wilson_interval


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
