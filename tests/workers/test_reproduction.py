"""The paper's tables as trainings, the curves that come of them, and verdicts that say no more than the seeds can carry."""

import math
from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.config import TaskConfig
from workers.config import DdpgConfig
from workers.presets import paper_ddpg
from workers.reproduction.claims import CLAIMS, AnyClaim, Comparison, Safety
from workers.reproduction.curves import band, binned
from workers.reproduction.drawing import draw_curves
from workers.reproduction.pace import Share, seconds_left
from workers.reproduction.results import SeedResult, Trained, learned_at, row_spread
from workers.reproduction.rows import FIGURES, LOGIT_PENALTY, OTHER_WAY, PAPER_ROWS, ROW_BY_ID, ROWS, STEPS, TABLES, scaled
from workers.reproduction.verdict import judge, judge_all
from workers.reproduction.widths import seeds_wanted, too_wide
from workers.training.drives import drive
from workers.training.table import METRICS, TableRow

LEARNED_AT = 100_000


def seeds(
    *successes: float, reward: float = 10.0, steps: float = 111.0, collisions: float = 0.0, learned: int | None = LEARNED_AT
) -> list[SeedResult]:
    return [
        SeedResult(
            seed=seed,
            steps=STEPS,
            measured=TableRow(reward=reward, episodes=90, success=success, collisions=collisions, steps=steps),
            learned_at=learned,
        )
        for seed, success in enumerate(successes)
    ]


def claim(identifier: str) -> AnyClaim:
    return next(one for one in CLAIMS if one.id == identifier)


# --- what the paper says ---


def test_the_tables_hold_every_row_and_multiply_to_about_ten_thousand_steps() -> None:
    assert {row for table in TABLES for row in table.rows} == {row.id for row in PAPER_ROWS}
    assert [len(table.rows) for table in TABLES] == [3, 2, 3]
    for row in ROWS:
        assert 9_400 < row.paper.episodes * row.paper.steps < 10_010


def test_every_comparison_is_one_that_the_papers_own_figures_make() -> None:
    assert len({one.id for one in CLAIMS}) == len(CLAIMS)
    for one in CLAIMS:
        if isinstance(one, Comparison):
            better, worse = ROW_BY_ID[one.better].paper, ROW_BY_ID[one.worse].paper
            assert {
                "success": better.success > worse.success,
                "reward": (better.reward or 0) > (worse.reward or 0),
                "steps": better.steps < worse.steps,
                "learned_at": True,  # a curve without numbers
            }[one.measure], one.id


def test_all_methods_of_a_figure_get_the_same_steps() -> None:
    for figure in FIGURES:
        assert {ROW_BY_ID[row].training.steps for row in figure.rows} == {STEPS}


def test_the_papers_ddpg_does_not_follow_the_forms_defaults() -> None:
    assert paper_ddpg().model_fields_set | {"name"} == set(DdpgConfig.model_fields)
    assert ROW_BY_ID["simple-basic-ddpg"].training.algorithm == paper_ddpg()


def test_ddpg_is_trained_the_other_way_with_nothing_changed_but_its_penalty() -> None:
    assert set(OTHER_WAY) == {row.id for row in PAPER_ROWS if row.method == "DDPG"}
    for published, penalised in ((ROW_BY_ID[one], ROW_BY_ID[other]) for one, other in OTHER_WAY.items()):
        assert (penalised.instead_of, penalised.paper) == (published.id, published.paper)
        cured = published.training.algorithm.model_copy(update={"logit_penalty": LOGIT_PENALTY})
        assert penalised.training == published.training.model_copy(update={"algorithm": cured})
        # The cure is the one that our own recipe has.
        assert DdpgConfig().logit_penalty == LOGIT_PENALTY


def test_a_trial_has_a_part_of_the_steps_and_as_many_evaluations() -> None:
    training = ROWS[0].training
    trial = scaled(training, 0.1)
    assert (trial.steps, trial.evaluation.every_steps) == (60_000, 2_500)
    assert trial.model_copy(update={"steps": STEPS, "evaluation": training.evaluation}) == training
    assert scaled(training, 1e-4).steps == 1_000


# --- verdicts ---


@pytest.mark.parametrize(
    ("better", "worse", "word"),
    [
        ((0.99, 0.98, 0.97, 0.99, 0.98), (0.80, 0.82, 0.79, 0.85, 0.81), "holds"),
        ((0.80, 0.82, 0.79, 0.85, 0.81), (0.99, 0.98, 0.97, 0.99, 0.98), "does not hold"),
        ((1.0, 1.0, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 1.0, 1.0), "does not hold"),  # no difference to speak of
        ((0.999, 0.999, 0.999, 0.999, 0.998), (0.996, 0.996, 0.996, 0.997, 0.996), "does not hold"),  # sure, and too small
        ((0.70, 0.95, 0.80, 0.90, 0.75), (0.72, 0.93, 0.85, 0.78, 0.80), "can't be told"),
        ((1.0, 1.0, 1.0, 1.0), (0.3, 0.3, 0.3, 0.3), "can't be told"),  # four seeds
    ],
)
def test_words_for_a_comparison(better: Sequence[float], worse: Sequence[float], word: str) -> None:
    one = claim("simple-success-vanilla")
    assert isinstance(one, Comparison)
    assert judge(one, {one.better: seeds(*better), one.worse: seeds(*worse)}).word == word


def test_the_reason_has_the_difference_and_its_interval() -> None:
    """Means 0.93 and 0.83, deviations 0.0158 over five: on the logit [90.75, 94.71] and [80.95, 84.88].

    The ends of the difference: 10 - hypot(2.25, 1.88) and 10 + hypot(1.71, 2.05).
    """
    one = claim("complex-success")
    assert isinstance(one, Comparison)
    results = {one.better: seeds(0.91, 0.92, 0.93, 0.94, 0.95), one.worse: seeds(0.81, 0.82, 0.83, 0.84, 0.85)}
    verdict = judge(one, results)
    assert verdict.reason == "10.0 points more, 95 % interval [+7.1, +12.7], all of it in favour of the claim."
    assert verdict.evidence == "The paper: 59 of 63 against 59 of 87 with one seed each, p < 0.001 (Fisher's exact test)."
    assert verdict.rows == (one.better, one.worse)


def test_the_papers_effect_is_compatible_inside_our_interval() -> None:
    """The paper: 59 of 63 against 59 of 87, 25.8 points more."""
    one = claim("complex-success")
    assert isinstance(one, Comparison)
    results = {one.better: seeds(0.90, 0.95, 0.92, 0.97, 0.94), one.worse: seeds(0.60, 0.75, 0.68, 0.72, 0.65)}
    found = judge(one, results).compatibility
    assert found is not None
    assert found.word == "compatible"
    assert found.sentence == "The paper's effect, +25.8 points, lies inside our interval: compatible."


def test_what_single_seeds_may_show_is_no_contradiction() -> None:
    """Means 0.85 and 0.75, deviation 0.05: one seed of each spreads by 0.05 x sqrt(2 x 1.2), t with 8 degrees of freedom.

    That is 17.9 points; the paper's own 63 and 87 attempts add 1.96 x sqrt(0.85 x 0.15 / 63 + 0.68 x 0.32 / 87) = 13.2.
    """
    one = claim("complex-success")
    assert isinstance(one, Comparison)
    step = 0.05 / math.sqrt(2.5)
    better, worse = ([centre + step * place for place in (-2, -1, 0, 1, 2)] for centre in (0.85, 0.75))
    found = judge(one, {one.better: seeds(*better), one.worse: seeds(*worse)}).compatibility
    assert found is not None
    assert found.word == "one seed's luck"
    assert found.sentence == (
        "The paper's effect, +25.8 points, lies outside our interval, but one seed of each, as the paper has, may show "
        "-12.2 to +32.2."
    )


def test_an_effect_that_no_seed_shows_is_not_compatible() -> None:
    """Vanilla PPO arrives in 30 % of the paper's attempts, and in all of ours."""
    one = claim("simple-success-vanilla")
    assert isinstance(one, Comparison)
    verdict = judge(one, {one.better: seeds(1, 1, 1, 1, 1), one.worse: seeds(1, 1, 1, 1, 1)})
    assert verdict.word == "does not hold"
    assert verdict.compatibility is not None
    assert verdict.compatibility.word == "not compatible"
    assert verdict.compatibility.sentence.startswith("The paper's effect, +69.6 points, lies outside our interval, and")


def test_a_curve_without_numbers_is_neither_compatible_nor_not() -> None:
    one = claim("simple-converges-vanilla")
    assert isinstance(one, Comparison)
    assert judge(one, {one.better: seeds(*[1] * 5), one.worse: seeds(*[1] * 5, learned=None)}).compatibility is None


def test_fewer_steps_are_better() -> None:
    one = claim("complex-slower")
    assert isinstance(one, Comparison)
    quick, slow = seeds(1, 1, 1, 1, 1, steps=100.0), seeds(1, 1, 1, 1, 1, steps=150.0)
    verdict = judge(one, {one.better: quick, one.worse: slow})
    assert verdict.word == "holds"
    assert verdict.reason.startswith("50.0 steps per episode fewer, 95 % interval [-50.0, -50.0]")
    assert judge(one, {one.better: slow, one.worse: quick}).reason.startswith("50.0 steps per episode more")


def test_what_is_said_of_ddpg_is_judged_both_ways() -> None:
    one = claim("simple-success-ddpg")
    assert isinstance(one, Comparison)
    always, once_never = seeds(1, 1, 1, 1, 1), seeds(1, 1, 0, 1, 1)
    verdict = judge(one, {one.better: always, one.worse: once_never, OTHER_WAY[one.worse]: always})
    assert (verdict.word, verdict.rows) == ("can't be told", (one.better, one.worse))
    assert verdict.other_way is not None
    assert verdict.other_way.word == "does not hold"
    assert verdict.other_way.reason.startswith("The two are equivalent within 1.0 points")
    assert verdict.other_way.rows == (one.better, OTHER_WAY[one.worse])
    # Not trained the other way, nothing is told of it; where no DDPG is compared there is no other way.
    other = judge(one, {one.better: always, one.worse: once_never}).other_way
    assert other is not None
    assert other.reason == "No verdict below 5 seeds: 0 of 5 done."
    assert judge(claim("simple-success-vanilla"), {}).other_way is None
    assert judge(claim("safe"), {}).other_way is None


# --- more seeds ---


def spread_evenly(centre: float, reach: float, count: int) -> list[SeedResult]:
    return seeds(*np.linspace(centre - reach, centre + reach, count).tolist())


@pytest.mark.parametrize("better", [0.95, 0.75])
def test_more_seeds_go_where_intervals_are_wide_whichever_way_they_point(better: float) -> None:
    one = claim("complex-success")
    assert isinstance(one, Comparison)
    wide = {one.better: spread_evenly(better, 0.04, 5), one.worse: spread_evenly(0.75, 0.1, 5)}
    # Steps, rewards and collisions do not differ from seed to seed: success alone is wide.
    assert too_wide(wide) == {one.better, one.worse}
    narrow = {row: spread_evenly(0.75 if row == one.worse else better, 0.002, 20) for row in wide}
    assert too_wide(narrow) == frozenset()


def test_an_interval_that_is_wide_only_the_other_way_counts() -> None:
    one = claim("simple-success-ddpg")
    assert isinstance(one, Comparison)
    results = {one.better: seeds(*[1] * 5), one.worse: seeds(*[1] * 5), OTHER_WAY[one.worse]: seeds(1, 1, 0, 1, 1)}
    assert too_wide(results) == {one.better, OTHER_WAY[one.worse]}


def test_five_seeds_at_a_time_up_to_a_bound() -> None:
    one = claim("complex-success")
    assert isinstance(one, Comparison)
    wide = {one.better: spread_evenly(0.9, 0.08, 5), one.worse: spread_evenly(0.75, 0.1, 5)}
    assert seeds_wanted(wide, {one.better: 5, one.worse: 5, "another": 5}) == {one.better: 10, one.worse: 10}
    # One that failed counts: what does not end well is not tried until it does.
    assert seeds_wanted(wide, {one.better: 6, one.worse: 38}) == {one.better: 11, one.worse: 40}
    assert seeds_wanted(wide, {one.better: 40, one.worse: 40}) == {}
    assert seeds_wanted(wide, {one.better: 5, one.worse: 7}, at_most=7) == {one.better: 7}


def test_who_never_learned_counts_as_having_learned_at_the_end() -> None:
    one = claim("simple-converges-vanilla")
    assert isinstance(one, Comparison)
    learned, never = seeds(1, 1, 1, 1, 1), seeds(0, 0, 0, 0, 0, learned=None)
    verdict = judge(one, {one.better: learned, one.worse: never})
    assert verdict.word == "holds"
    assert verdict.reason.startswith("500\u202f000 training steps fewer")
    assert judge(one, {one.better: never, one.worse: never}).reason.startswith("No seed of either reached 90%")


@pytest.mark.parametrize(
    ("rates", "word"),
    [
        ((0.0, 0.0, 0.0, 0.0, 0.0), "holds"),
        ((0.10, 0.12, 0.08, 0.11, 0.09), "does not hold"),
        ((0.0, 0.0, 0.05, 0.0, 0.0), "can't be told"),
    ],
)
def test_safety_is_at_most_one_collision_in_a_hundred_attempts(rates: Sequence[float], word: str) -> None:
    one = claim("safe")
    assert isinstance(one, Safety)
    results = {one.row: [seed for rate in rates for seed in seeds(1.0 - rate, collisions=rate)]}
    assert judge(one, results).word == word


def test_without_results_nothing_can_be_told() -> None:
    verdicts = judge_all({})
    assert {verdict.word for verdict in verdicts} == {"can't be told"}
    assert len(verdicts) == len(CLAIMS)
    assert verdicts[0].reason == "No verdict below 5 seeds: 0 of 5 done."
    assert {verdict.compatibility for verdict in verdicts} == {None}


@given(st.lists(st.floats(0, 1), min_size=5, max_size=8), st.lists(st.floats(0, 1), min_size=5, max_size=8))
def test_a_claim_and_its_opposite_never_both_hold(better: list[float], worse: list[float]) -> None:
    one = claim("complex-success")
    assert isinstance(one, Comparison)
    there = judge(one, {one.better: seeds(*better), one.worse: seeds(*worse)}).word
    back = judge(one, {one.better: seeds(*worse), one.worse: seeds(*better)}).word
    assert {there, back} in ({"holds", "does not hold"}, {"does not hold"}, {"can't be told"})


# --- figures ---


def test_drive_counts_as_the_tables_do() -> None:
    """A robot that stands still: a time-out every 500 steps, no progress, no reward."""
    still = drive(lambda seen: np.zeros((len(seen), 2), np.float32), TaskConfig(), drives=3, steps=1_500)
    assert still == TableRow(reward=0.0, episodes=3.0, success=0.0, collisions=0.0, steps=500.0)
    assert set(still.metrics()) == set(METRICS)
    assert TableRow.from_metrics(still.metrics() | {"eval/return": 1.0}) == still
    assert TableRow.from_metrics({"eval/return": 1.0}) is None


def test_the_papers_rows_have_no_collisions_to_report() -> None:
    assert "table/collisions" not in ROWS[0].paper.metrics()
    assert TableRow.from_metrics(ROWS[0].paper.metrics()) is None


def test_spread_over_seeds_stays_within_what_can_be() -> None:
    """Mean 0.98, error 0.02 / sqrt(5), on the logit of 4,410.5 in 4,501 that / (0.97989 x 0.02011) x 2.7764 = 1.2604."""
    spread = row_spread(seeds(0.96, 0.96, 0.98, 1.0, 1.0))
    assert spread is not None
    assert (spread.success.low, spread.success.high) == pytest.approx((0.93255, 0.99421), abs=1e-4)
    assert spread.failed.sentence == "None of 5 seeds failed: up to 45 % may (one-sided 95 %)."
    assert row_spread(seeds(0.5)) is not None
    assert row_spread([]) is None


def test_learned_at_the_first_evaluation_that_is_good_enough() -> None:
    assert learned_at([10, 20, 30], [0.5, 0.9, 0.8]) == 20
    assert learned_at([10, 20], [0.5, 0.89]) is None


def test_bins_average_and_bridge_gaps_only_between_points() -> None:
    edges = np.array([0.0, 10, 20, 30, 40, 50])
    curve = binned([12, 18, 35, 99], [1.0, 3.0, 6.0, 9.0], edges)
    np.testing.assert_allclose(curve, [np.nan, 2.0, 4.0, 6.0, np.nan])


def test_the_mean_is_over_all_seeds_or_not_there() -> None:
    mean, low, high = band(np.array([[1.0, np.nan, np.nan], [3.0, 5.0, np.nan]]))
    np.testing.assert_allclose(mean, [2.0, np.nan, np.nan])
    # Two seeds, one degree of freedom: 12.706 x sqrt(2) / sqrt(2).
    np.testing.assert_allclose(high - mean, [12.706, np.nan, np.nan], atol=1e-3)
    np.testing.assert_allclose(mean - low, high - mean)


def test_the_picture_draws_each_seed_and_the_mean_of_every_row_that_was_trained() -> None:
    curve = (1.0, 50.0, 1_700.0)
    trained = [Trained(result=one, curve_steps=(4_096, 300_000, STEPS), curve=curve) for one in seeds(0.9, 0.8)]
    svg = ElementTree.fromstring(draw_curves({"complex-basic-ddpg": trained}))
    paths = [path.attrib for path in svg.iter("{http://www.w3.org/2000/svg}path")]
    # In two figures; each mean has its mark in the legend as well.
    assert sum(path["class"].startswith("seed") for path in paths) == 2 * 2
    assert sum(path["class"].startswith("mean") for path in paths) == 2 * 2
    assert not any("nan" in path["d"] for path in paths)
    assert "not trained" in ElementTree.tostring(svg, encoding="unicode")


# --- time ---


def test_time_left_starts_from_what_is_known_and_follows_what_is_seen() -> None:
    fresh = [Share(expected=60.0, done=0.0)] * 4
    assert seconds_left(fresh, side_by_side=2) == 120.0
    assert seconds_left([Share(expected=60.0, done=0.0)], side_by_side=2) == 60.0, "one training has one core"
    # Half the work took twice as long as foreseen, and so will the rest.
    half = [Share(expected=60.0, done=1.0, spent=120.0)] * 2 + [Share(expected=60.0, done=0.0)] * 2
    assert seconds_left(half, side_by_side=2) == 120.0
    assert seconds_left([Share(expected=60.0, done=1.0, spent=60.0)], side_by_side=2) == 0.0


@given(st.lists(st.tuples(st.floats(1, 1e4), st.floats(0, 1), st.floats(0, 1e5)), min_size=1), st.integers(1, 64))
def test_time_left_is_a_time(parts: list[tuple[float, float, float]], side_by_side: int) -> None:
    left = seconds_left([Share(expected=e, done=d, spent=s) for e, d, s in parts], side_by_side)
    assert math.isfinite(left)
    assert left >= 0.0
