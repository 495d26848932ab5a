"""Intervals, verdicts and tests against figures from the literature, or worked by hand."""

import math

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from workers.statistics.differences import (
    Difference,
    Rates,
    arrival_rates,
    difference_of_means,
    difference_of_rates,
    fisher_exact,
    rates_difference,
    rates_less_policy,
)
from workers.statistics.improvement import performance_profile, probability_of_improvement
from workers.statistics.intervals import exact_interval, student_t, upper_bound
from workers.statistics.seeds import (
    failed_seeds,
    mean_interval,
    mean_over_seeds,
    means_band,
    rates_band,
    success_rate,
)
from workers.statistics.significance import (
    LEAST_P,
    holm,
    p_of_means,
    p_of_rates,
    p_of_seeds_and_policy,
    paired_rates,
    paired_values,
)

# --- of one policy ---


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        (81, 263, 0.2527, 0.3676),  # Newcombe (1998), table I, method 5
        (15, 148, 0.0578, 0.1617),
        (0, 20, 0.0000, 0.1684),
        (1, 29, 0.0009, 0.1776),
        (90, 90, 0.9598, 1.0000),  # the paper's 90 of 90
    ],
)
def test_exact_interval_as_tabled(successes: int, trials: int, low: float, high: float) -> None:
    found = exact_interval(successes, trials)
    assert (float(found[0]), float(found[1])) == pytest.approx((low, high), abs=5e-5)


@given(trials=st.floats(1, 1e6), share=st.floats(0, 1))
def test_exact_interval_holds_its_rate_and_mirrors(trials: float, share: float) -> None:
    successes = min(share * trials, trials)
    low, high = exact_interval(successes, trials)
    _, mirrored_high = exact_interval(trials - successes, trials)
    assert 0 <= low <= successes / trials <= high <= 1
    assert low == pytest.approx(1 - mirrored_high, abs=1e-6)


@pytest.mark.parametrize(("successes", "trials"), [(0, 0), (5, 4), (2, 1), (-1, 5)])
def test_impossible_counts_are_refused(successes: int, trials: int) -> None:
    with pytest.raises(ValueError, match="no interval"):
        exact_interval(successes, trials)


@pytest.mark.parametrize(
    ("freedom", "quantile"), [(1, 12.7062), (2, 4.3027), (4, 2.7764), (8, 2.3060), (30, 2.0423), (np.inf, 1.9600)]
)
def test_student_t_as_tabled(freedom: float, quantile: float) -> None:
    assert float(student_t(freedom)) == pytest.approx(quantile, abs=5e-5)


def test_one_seed_has_the_interval_of_its_own_episodes() -> None:
    low, high = exact_interval(8, 10)
    found = success_rate([8], [10])
    assert (found.value, found.low, found.high) == (0.8, float(low), float(high))

    # The mean of 400 episodes of unit variance has a standard error of 0.05; t with 399 degrees of freedom is 1.966.
    values = np.random.default_rng(1).normal(size=400)
    interval = mean_over_seeds([(values - values.mean()) / values.std(ddof=1)])
    assert (interval.low, interval.high) == pytest.approx((-0.0983, 0.0983), abs=1e-4)


# --- of a few seeds ---


def test_what_few_seeds_leave_open() -> None:
    """None of five: 1 - 0.05 ** (1 / 5) = 45.07 %; of 59, the rule of three, 5 %."""
    assert upper_bound(0, 5) == pytest.approx(1 - 0.05 ** (1 / 5))
    assert upper_bound(0, 59) == pytest.approx(0.0495, abs=1e-4)
    assert upper_bound(5, 5) == 1.0

    good = failed_seeds([1.0, 0.97, 0.99, 1.0, 0.98])
    assert (good.failed, good.seeds) == (0, 5)
    assert good.sentence == "None of 5 seeds failed: up to 45 % may (one-sided 95 %)."
    # One of five: the beta quantile of 2 and 4, tabled as 65.74 %.
    assert failed_seeds([1.0, 1.0, 0.5, 1.0, 1.0]).at_most == pytest.approx(0.6574, abs=1e-4)
    assert failed_seeds([1.0, 1.0, 0.5, 1.0, 1.0]).sentence == "1 of 5 seeds failed: up to 66 % may (one-sided 95 %)."
    assert failed_seeds([0.9]).sentence == "One seed alone: of others up to 95 % may fail (one-sided 95 %)."
    assert failed_seeds([0.0, 0.0]).sentence == "All 2 seeds failed."


def test_a_hard_task_is_no_failure() -> None:
    """All seeds arrive in about 30 %: none is half as bad as the best."""
    assert failed_seeds([0.28, 0.31, 0.3]).failed == 0


def test_half_of_what_is_useless_is_no_failure() -> None:
    """1 and 2 %: half of the best, and yet neither is the odd one."""
    useless = failed_seeds([0.01, 0.02])
    assert (useless.failed, useless.told) == (0, False)
    assert useless.sentence == "Even the best of 2 seeds arrives in 2 % only: which have failed can't be said."
    assert not failed_seeds([0.19, 0.05, 0.0]).told
    assert failed_seeds([0.2, 0.05, 0.2]).failed == 1


def test_two_seeds_do_not_say_which_is_the_usual_one() -> None:
    apart = failed_seeds([0.9, 0.3])
    assert (apart.failed, apart.told) == (0, False)
    assert apart.sentence.startswith("One of 2 seeds arrives at most half as often as the other")
    assert failed_seeds([0.9, 0.8]).sentence == "None of 2 seeds failed: up to 78 % may (one-sided 95 %)."
    # One that never arrives has failed whatever the other does; of three, the odd one is told.
    assert failed_seeds([0.9, 0.0]).sentence.startswith("1 of 2 seeds failed")
    assert failed_seeds([0.9, 0.3, 0.9]).failed == 1


def test_an_interval_ends_where_the_measure_does() -> None:
    """Two seeds of 21 and 126 steps: Student's t with one degree of freedom would go on to -594."""
    samples = [np.array([21.0, 21.0]), np.array([126.0, 126.0])]
    open_, cut = mean_over_seeds(samples), mean_over_seeds(samples, least=0.0)
    assert open_.low == pytest.approx(73.5 - 12.706 * 52.5, abs=0.1)
    assert (cut.value, cut.low, cut.high) == (open_.value, 0.0, open_.high)


def test_mean_interval() -> None:
    """1 to 5: deviation sqrt(2.5), error sqrt(2.5 / 5), times 2.7764."""
    found = mean_interval([1, 2, 3, 4, 5])
    assert (found.value, found.low, found.high) == pytest.approx((3.0, 3.0 - 1.9632, 3.0 + 1.9632), abs=1e-3)
    alone = mean_interval([7.0])
    assert (alone.value, alone.low, alone.high) == (7.0, 7.0, 7.0)


def test_seeds_means_have_students_interval_whatever_their_episodes() -> None:
    """Means 1 to 5 of two episodes that hardly differ."""
    samples = [np.array([mean - 1e-3, mean + 1e-3]) for mean in (1.0, 2.0, 3.0, 4.0, 5.0)]
    found = mean_over_seeds(samples)
    assert (found.value, found.low, found.high) == pytest.approx((3.0, 1.0368, 4.9632), abs=1e-3)


def test_seeds_that_agree_by_luck_keep_their_episodes_error() -> None:
    """Both means are 0, each with an error of 1 / sqrt(2): together sqrt(0.5 + 0.5) / 2 = 0.5, times 1.96."""
    found = mean_over_seeds([np.array([-1.0, 0.0, 1.0]) * math.sqrt(1.5), np.array([1.0, 0.0, -1.0]) * math.sqrt(1.5)])
    assert (found.value, found.low, found.high) == pytest.approx((0.0, -0.98, 0.98), abs=1e-3)


def test_seeds_without_spread_leave_no_interval() -> None:
    found = mean_over_seeds([np.full(20, 7.0), np.full(30, 7.0)])
    assert (found.value, found.low, found.high) == (7.0, 7.0, 7.0)


def test_an_estimate_needs_episodes_of_every_seed() -> None:
    with pytest.raises(ValueError, match="at least one episode"):
        mean_over_seeds([np.ones(3), np.zeros(0)])
    with pytest.raises(ValueError, match="one number a seed"):
        success_rate([1], [1, 1])


def test_success_has_students_t_on_the_logit() -> None:
    """Rates 75 and 85 % of a million episodes: mean 80 %, error 5 points, 0.05 / (0.8 * 0.2) = 0.3125 on the logit.

    Student's t with one degree of freedom is 12.7062, so logit(0.8) = 1.3863 -+ 3.9707: 7.01 and 99.53 %.
    """
    found = success_rate([750_000, 850_000], [1_000_000, 1_000_000])
    assert (found.value, found.low, found.high) == pytest.approx((0.8, 0.0701, 0.9953), abs=1e-4)


def test_seeds_that_agree_are_no_surer_than_their_episodes() -> None:
    """At the ceiling all agree: Clopper and Pearson leave 1 - 0.025 ** (1 / 1000) open, 0.37 %."""
    found = success_rate([200] * 5, [200] * 5)
    assert (found.value, found.low, found.high) == pytest.approx((1.0, 0.025 ** (1 / 1000), 1.0))


counts = st.lists(st.integers(0, 200), min_size=2, max_size=8)


@given(counts)
def test_success_holds_its_rate_and_mirrors(arrivals: list[int]) -> None:
    episodes = [200] * len(arrivals)
    found, mirrored = success_rate(arrivals, episodes), success_rate([200 - n for n in arrivals], episodes)
    assert 0.0 <= found.low <= found.value <= found.high <= 1.0
    assert found.value == pytest.approx(np.mean(arrivals) / 200)
    assert (mirrored.low, mirrored.high) == pytest.approx((1 - found.high, 1 - found.low), abs=1e-9)
    # The episodes alone leave this much open, but for the last bit.
    low, high = exact_interval(sum(arrivals), sum(episodes))
    assert found.low <= low + 1e-12 <= high + 2e-12 <= found.high + 3e-12


@given(counts, st.floats(0.5, 0.99))
def test_less_confidence_is_a_narrower_interval(arrivals: list[int], confidence: float) -> None:
    episodes = [200] * len(arrivals)
    wide, narrow = success_rate(arrivals, episodes, 0.999), success_rate(arrivals, episodes, confidence)
    assert wide.low <= narrow.low
    assert narrow.high <= wide.high


# --- curves ---


def test_a_band_has_an_interval_where_two_seeds_have_values() -> None:
    """1 and 3: error 1, times 12.7062."""
    mean, low, high = means_band(np.array([[1.0, 1.0, np.nan], [3.0, np.nan, np.nan]]))
    assert mean.tolist()[:2] == [2.0, 1.0]
    assert (low[0], high[0]) == pytest.approx((2.0 - 12.7062, 2.0 + 12.7062), abs=1e-4)
    assert np.isnan(mean[2])
    assert np.isnan(low[1:]).all()
    assert np.isnan(high[1:]).all()


def test_a_band_of_rates_is_the_success_rate_of_each_point() -> None:
    rates = np.array([[0.5, 1.0, np.nan], [0.75, 1.0, 0.9], [0.6, 1.0, np.nan]])
    mean, low, high = rates_band(rates, np.full((3, 1), 20.0))
    for point in (0, 1):
        found = success_rate((rates[:, point] * 20).tolist(), [20] * 3)
        assert (mean[point], low[point], high[point]) == pytest.approx((found.value, found.low, found.high))
    assert (mean[2], np.isnan(low[2]), np.isnan(high[2])) == (0.9, True, True)


def test_a_band_of_rates_needs_no_episodes() -> None:
    mean, low, high = rates_band(np.array([[0.75, 1.0], [0.85, 1.0]]))
    assert (mean[0], low[0], high[0]) == pytest.approx((0.8, 0.0701, 0.9953), abs=1e-4)
    assert (mean[1], low[1], high[1]) == (1.0, 1.0, 1.0)


# --- differences ---


def ends(found: Difference) -> tuple[float, float, float]:
    return found.value, found.low, found.high


def test_difference_of_means() -> None:
    """Equal variances of 2.5 over five seeds each: error 1, 8 degrees of freedom, 2.3060 either way; 1.8595 for 90 %."""
    found = difference_of_means([2, 3, 4, 5, 6], [1, 2, 3, 4, 5])
    assert ends(found) == pytest.approx((1.0, -1.3060, 3.3060), abs=1e-3)
    assert (found.equivalent_low, found.equivalent_high) == pytest.approx((1 - 1.8595, 1 + 1.8595), abs=1e-3)
    # One side without spread: only the other's 4 degrees of freedom are left, and its error of sqrt(0.5).
    assert ends(difference_of_means([1, 2, 3, 4, 5], [0] * 5)) == pytest.approx((3.0, 1.0368, 4.9632), abs=1e-3)
    assert ends(difference_of_means([1.0] * 5, [0.5] * 5)) == (0.5, 0.5, 0.5)
    with pytest.raises(ValueError, match="two seeds"):
        difference_of_means([1.0], [1.0, 2.0])


seeds = st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=8)


@given(seeds, seeds)
def test_difference_of_means_holds_its_difference_and_mirrors(first: list[float], second: list[float]) -> None:
    difference, low, high = ends(difference_of_means(first, second))
    assert low <= difference <= high
    assert ends(difference_of_means(second, first)) == pytest.approx((-difference, -high, -low))


def test_difference_of_rates_is_the_wider_of_two() -> None:
    """Zou and Donner 2008: from the lower end of the first and the upper end of the second, and the other way round."""
    one, other = Rates([180, 190, 185, 170, 195], [200] * 5), Rates([150, 160, 140, 155, 145], [200] * 5)
    first, second = success_rate(one.arrivals, one.episodes), success_rate(other.arrivals, other.episodes)
    found = difference_of_rates(one, other)
    welch = difference_of_means([0.9, 0.95, 0.925, 0.85, 0.975], [0.75, 0.8, 0.7, 0.775, 0.725])
    low = 0.17 - math.hypot(0.92 - first.low, second.high - 0.75)
    high = 0.17 + math.hypot(first.high - 0.92, 0.75 - second.low)
    assert low < welch.low < welch.high < high
    assert ends(found) == pytest.approx((0.17, low, high))


def test_one_seed_that_fails_is_no_direction() -> None:
    """Four of five arrive always, one never, beside five that always do.

    Welch: 0.2 with an error of 0.2 and 4 degrees of freedom, 2.7764: from -35.5 points.
    """
    found = difference_of_rates(Rates([200] * 5, [200] * 5), Rates([200, 200, 0, 200, 200], [200] * 5))
    assert found.value == pytest.approx(0.2)
    assert found.low == pytest.approx(0.2 - 2.7764 * 0.2, abs=1e-4)
    assert found.word(margin=0.02) == "not told"


def test_two_perfect_sides_may_still_differ() -> None:
    """Each side may fall short by 0.37 %, see above."""
    found = difference_of_rates(Rates([200] * 5, [200] * 5), Rates([200] * 5, [200] * 5))
    assert ends(found) == pytest.approx((0.0, 0.025 ** (1 / 1000) - 1, 1 - 0.025 ** (1 / 1000)))


@given(counts, counts)
def test_difference_of_rates_holds_its_difference_and_mirrors(first: list[int], second: list[int]) -> None:
    one, other = Rates(first, [200] * len(first)), Rates(second, [200] * len(second))
    found, back = difference_of_rates(one, other), difference_of_rates(other, one)
    assert found.low <= found.equivalent_low <= found.value <= found.equivalent_high <= found.high
    assert ends(back) == pytest.approx(ends(found.mirrored))


# --- verdicts ---


@pytest.mark.parametrize(
    ("low", "inner_low", "inner_high", "high", "word"),
    [
        (0.01, 0.02, 0.06, 0.07, "higher"),
        (-0.07, -0.06, -0.02, -0.01, "lower"),
        (-0.03, -0.01, 0.05, 0.07, "not told"),
        (-0.025, -0.019, 0.019, 0.025, "equivalent"),  # two one-sided tests at 5 %: the 90 % interval within the margin
        (-0.025, -0.021, 0.017, 0.023, "not told"),
        (0.001, 0.002, 0.006, 0.007, "equivalent"),  # sure, and too small to matter
        (0.0, 0.001, 0.03, 0.04, "not told"),
    ],
)
def test_words_for_a_difference(low: float, inner_low: float, inner_high: float, high: float, word: str) -> None:
    assert Difference((low + high) / 2, low, high, inner_low, inner_high).word(margin=0.02) == word


@given(seeds, seeds, st.floats(1e-3, 1e3))
def test_a_verdict_mirrors(first: list[float], second: list[float], margin: float) -> None:
    difference = difference_of_means(first, second)
    mirrored = {"higher": "lower", "lower": "higher"}
    word = difference.word(margin)
    assert difference.mirrored.word(margin) == mirrored.get(word, word)


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


@given(st.integers(1, 3_000), st.integers(1, 3_000), st.data())
def test_fisher_exact_is_what_scipy_has(trials: int, other_trials: int, data: st.DataObject) -> None:
    good, other_good = data.draw(st.integers(0, trials)), data.draw(st.integers(0, other_trials))

    table = [[good, trials - good], [other_good, other_trials - other_good]]
    expected = float(scipy.stats.fisher_exact(table).pvalue)
    assert fisher_exact((good, trials), (other_good, other_trials)) == pytest.approx(expected, rel=1e-6, abs=1e-300)


# --- tests beside the intervals ---


def test_p_is_where_the_interval_touches_zero() -> None:
    """Means 3 and 6.3 of five, deviations 1.5811 and 1.8908: t = 2.9938 with 7.757 degrees of freedom (R's t.test)."""
    first, second = [1.0, 2.0, 3.0, 4.0, 5.0], [4.0, 5.5, 6.0, 7.0, 9.0]
    assert p_of_means(first, second) == pytest.approx(0.01692, abs=1e-4)
    assert p_of_means(second, first) == p_of_means(first, second)
    assert p_of_means([1.0, 1.0], [2.0, 2.0]) == LEAST_P
    assert p_of_means([1.0, 3.0], [2.0, 2.0]) == 1.0

    better, worse = Rates([990, 980, 970, 990, 980], [1_000] * 5), Rates([900, 920, 960, 950, 930], [1_000] * 5)
    p = p_of_rates(better, worse)
    one, driven = arrival_rates(better)
    other, other_driven = arrival_rates(worse)
    _, low, _ = rates_difference(one, driven, other, other_driven, 1.0 - p)
    assert 0.0 < p < 0.05
    assert float(low[0]) == pytest.approx(0.0, abs=1e-4)
    assert difference_of_rates(better, worse).low > 0.0


def test_seeds_against_a_policy_that_has_none() -> None:
    """80 of 100 stand on their episodes alone; a seed that fails keeps the others from telling."""
    steady, spread = Rates([980, 985, 990, 980, 985], [1_000] * 5), Rates([980, 985, 200, 980, 985], [1_000] * 5)
    assert p_of_seeds_and_policy(steady, 80, 100) < 1e-4
    assert p_of_seeds_and_policy(spread, 80, 100) > 0.5
    # The fewer episodes the policy has, the less is known of it.
    few = p_of_seeds_and_policy(steady, 8, 10)
    assert 0.001 < few < 0.2
    rates, driven = arrival_rates(steady)
    _, low, _ = rates_less_policy(rates, driven, 8, 10, 1.0 - few)
    assert float(low[0]) == pytest.approx(0.0, abs=1e-3)


def test_holm_as_worked_in_his_paper() -> None:
    """The smallest times four, the next times three, and none below the one before it."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.6, 0.9]) == [1.0, 1.0]
    assert holm([]) == []


def test_paired_success_of_single_seeds_is_mcnemars_exact_test() -> None:
    """10 to 2 of discordant scenarios: 2 * (1 + 12 + 66) / 2 ** 12."""
    first = np.array([[1.0] * 10 + [0.0] * 2 + [1.0] * 8])
    second = np.array([[0.0] * 10 + [1.0] * 2 + [1.0] * 8])
    found = paired_rates(first, second)
    assert (found.scenarios, found.more, found.less) == (20, 10, 2)
    assert found.p == pytest.approx(2 * (1 + 12 + 66) / 2**12)


def test_shares_of_seeds_are_paired_whatever_their_number() -> None:
    """Of 2 and 3 seeds: +1, +1/2 and -1/3, in sixths +6, +3 and -2; sums of at least 7 are 7 and 11, of eight."""
    first = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    second = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    found = paired_rates(first, second)
    assert (found.more, found.less) == (2, 1)
    assert found.p == pytest.approx(2 * 2 / 8)
    assert paired_rates(first, first).p == 1.0


def test_paired_steps_have_wilcoxons_ranks() -> None:
    """Differences 1, 2, 3, 4 and -1.5 rank 1, 3, 4, 5 and -2: sums 13 and 2; at most 2 are 0, 1 and 2, of 32."""
    first = np.array([[11.0, 12.0, 13.0, 14.0, 8.5, np.nan, 10.0]])
    second = np.array([[10.0, 10.0, 10.0, 10.0, 10.0, 10.0, 10.0]])
    found = paired_values(first, second)
    assert found is not None
    assert (found.scenarios, found.more, found.less) == (6, 4, 1)
    assert found.p == pytest.approx(2 * 3 / 32)
    assert paired_values(first[:, 5:6], second[:, :1]) is None


def test_many_scenarios_have_the_normal_distribution_of_signs() -> None:
    """The exact test of 500 and the approximation for 5,000 go one way: 275 to 225, and 2,750 to 2,250."""
    few, many = (np.sign(np.arange(n) % 20 - 8.5) for n in (500, 5_000))
    zeros = np.zeros((1, 500))
    exact = paired_values(10 + few[None], 10 + zeros)
    assert exact is not None
    assert exact.p == pytest.approx(math.erfc(50 / math.sqrt(500) / math.sqrt(2)), rel=0.2)
    rough = paired_values(10 + many[None], 10 + np.zeros((1, 5_000)))
    assert rough is not None
    assert rough.p == LEAST_P


# --- whole distributions ---


def test_probability_of_improvement_counts_pairs_of_seeds_and_halves_ties() -> None:
    """Scenario 1: 2 beats 1 and 1, 1 ties twice; scenario 2: all tie: (1 + 0.5) / 2 and 0.5."""
    first, second = np.array([[2.0, 0.0], [1.0, 0.0]]), np.array([[1.0, 0.0], [1.0, 0.0]])
    found = probability_of_improvement(first, second)
    assert found.value == pytest.approx((0.75 + 0.5) / 2)
    assert found.low < found.value < found.high
    mirrored = probability_of_improvement(second, first)
    assert (mirrored.low, mirrored.high) == pytest.approx((1 - found.high, 1 - found.low))
    # Always better, five pairs that are independent: 0.025 ** (1 / 5).
    sure = probability_of_improvement(np.ones((5, 3)), np.zeros((7, 3)))
    assert (sure.value, sure.low, sure.high) == pytest.approx((1.0, 0.025**0.2, 1.0))
    with pytest.raises(ValueError, match="two seeds"):
        probability_of_improvement(first[:1], second)


def test_a_profile_is_the_mean_share_of_attempts_above_each_threshold() -> None:
    mean, low, high = performance_profile([np.array([0.0, 0.4, 0.8]), np.array([0.9, 0.9, 0.0])], np.array([0.0, 0.5, 1.0]))
    assert mean == pytest.approx([2 / 3, 1 / 2, 0.0])
    assert (low <= mean).all()
    assert (mean <= high).all()
