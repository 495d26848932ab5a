"""What a study tries next, how good it finds a trial, and when it stops one, by hand."""

import math
from typing import Any

import numpy as np
import optuna
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

from server.database.tables import StudyTrial
from server.studies.designs import grid_point, grid_size, grid_values, quasi_point
from server.studies.importance_intervals import LEAST_FOR_INTERVALS, intervals, shares
from server.studies.proposals import SamplerName, Told, importances, propose, trial_seed
from server.studies.rules import hopeless, rungs_of, score
from server.studies.space import ListedSetting, RangedSetting, Space, Value, Values
from server.studies.views import front
from workers.config import PpoConfig, TrainingConfig
from workers.networks.config import MlpNetwork
from workers.statistics.seeds import interquartile_mean

RATE = RangedSetting(kind="range", path="algorithm.learning_rate", low=1e-4, high=1e-2, log=True, points=3)
EPOCHS = RangedSetting(kind="range", path="algorithm.epochs", low=2, high=9, points=4)
SCHEDULE = ListedSetting(kind="list", path="algorithm.learning_rate_schedule", values=["linear", "constant"])


LAYERS = ListedSetting(kind="list", path="algorithm.network.hidden_sizes", values=[[64, 64], [128, 128], [256]])
COLLISION = RangedSetting(kind="range", path="task.reward.terms.1.weight", low=-400.0, high=-25.0, log=True, points=3)


def space(*settings: RangedSetting | ListedSetting) -> Space:
    return Space(TrainingConfig().model_dump(mode="json"), settings)


def as_number(value: Value) -> float:
    assert isinstance(value, int | float)
    return float(value)


def quality(values: Values) -> float:
    """Highest for five epochs and a constant rate."""
    return -abs(as_number(values["algorithm.epochs"]) - 5) - (values["algorithm.learning_rate_schedule"] == "linear")


class Uninterrupted:
    """A study of Optuna's own that lives from the first trial to the last, its sampler seeded for each trial as ours is."""

    def __init__(self, seed: int) -> None:
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self.study = optuna.create_study(direction="maximize")
        self.seed = seed
        self.distributions: dict[str, Any] = {
            RATE.path: FloatDistribution(1e-4, 1e-2, log=True),
            EPOCHS.path: IntDistribution(2, 9),
            SCHEDULE.path: CategoricalDistribution(("linear", "constant")),
        }

    def ask(self) -> optuna.Trial:
        number = len(self.study.trials)
        self.study.sampler = optuna.samplers.TPESampler(
            seed=trial_seed(self.seed, number), multivariate=True, constant_liar=True
        )
        return self.study.ask(self.distributions)


def test_a_study_made_anew_of_its_rows_proposes_what_an_uninterrupted_one_does() -> None:
    """Over the random trials at the start and those that follow; with failed ones, stopped ones and one that goes on."""
    ours = space(RATE, EPOCHS, SCHEDULE)
    theirs = Uninterrupted(seed=7)
    told: list[Told] = []
    for number in range(24):
        trial = theirs.ask()
        values = propose(ours, "tpe", 7, told)
        assert values == trial.params, number
        if number % 7 == 3:
            theirs.study.tell(trial, state=optuna.trial.TrialState.FAIL)
            told.append(Told(values, "failed"))
        elif number % 7 == 5:
            trial.report(quality(values), 2)
            theirs.study.tell(trial, state=optuna.trial.TrialState.PRUNED)
            told.append(Told(values, "pruned", rungs={2: quality(values)}))
        elif number == 20:
            told.append(Told(values, "running"))
        else:
            theirs.study.tell(trial, quality(values))
            told.append(Told(values, "complete", quality(values)))


def test_the_sampler_goes_on_where_trials_did_well() -> None:
    ours = space(RATE, EPOCHS, SCHEDULE)
    told: list[Told] = []
    for _ in range(40):
        values = propose(ours, "tpe", 1, told)
        told.append(Told(values, "complete", quality(values)))
    late = [one.score or 0.0 for one in told[25:]]
    assert sum(late) / len(late) > -1.5


def test_importances_name_what_mattered() -> None:
    ours = space(RATE, EPOCHS, SCHEDULE)
    drawn = [quasi_point(ours, 0, number) for number in range(64)]
    shares = importances(ours, [Told(each, "complete", -abs(as_number(each[EPOCHS.path]) - 5)) for each in drawn])
    assert sum(shares.values()) == pytest.approx(1.0)
    assert shares[EPOCHS.path] > 0.8


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 1000), trials=st.integers(LEAST_FOR_INTERVALS, 120), distinct=st.integers(2, 40))
def test_importances_on_counts_are_those_of_optuna(seed: int, trials: int, distinct: int) -> None:
    """Of floats, whole numbers, penalties by ratio and lists; with trials that did alike, which are all among the best."""
    whole = RangedSetting(kind="range", path="algorithm.robots", low=8, high=512, log=True)
    ours = Space(
        TrainingConfig(algorithm=PpoConfig(network=MlpNetwork())).model_dump(mode="json"),
        [RATE, EPOCHS, SCHEDULE, LAYERS, COLLISION, whole],
    )
    drawn = np.random.default_rng(seed)
    tried = [propose(ours, "random", seed, [Told({}, "failed")] * number) for number in range(trials)]
    scores = [float(drawn.integers(distinct)) / 40 for _ in tried]
    optunas = importances(ours, [Told(values, "complete", score) for values, score in zip(tried, scores, strict=True)])
    if optunas:
        assert shares(ours, tried, scores) == pytest.approx(optunas, abs=1e-9)


def test_an_interval_holds_what_many_trials_say_and_few_trials_tell_none() -> None:
    ours = space(RATE, EPOCHS, SCHEDULE)

    def some(seed: int, number: int) -> tuple[list[Values], list[float]]:
        tried = [propose(ours, "random", seed, [Told({}, "failed")] * before) for before in range(number)]
        return tried, [quality(each) - abs(math.log10(as_number(each[RATE.path])) + 3) for each in tried]

    truth = shares(ours, *some(99, 3_000))
    held = 0
    for seed in range(8):
        found = intervals(ours, *some(seed, 60))
        assert found == intervals(ours, *some(seed, 60))
        assert all(0.0 <= low < high <= 1.0 for low, high in found.values())
        held += sum(low <= truth[path] <= high for path, (low, high) in found.items())
    assert held >= 20
    assert intervals(ours, *some(0, LEAST_FOR_INTERVALS - 1)) == {}
    tried, _ = some(0, 40)
    assert intervals(ours, tried, [0.5] * 40) == {}


def test_of_failed_trials_nothing_is_learned() -> None:
    """Told as scores of 0 they would have drawn the sampler away from where they were."""
    ours = space(EPOCHS)
    trials: list[Values] = [{EPOCHS.path: 5}] * 12
    drawn = [propose(ours, "random", seed, [Told(each, "failed") for each in trials]) for seed in range(10)]
    assert [propose(ours, "tpe", seed, [Told(each, "failed") for each in trials]) for seed in range(10)] == drawn
    assert [propose(ours, "tpe", seed, [Told(each, "complete", 0.0) for each in trials]) for seed in range(10)] != drawn


def test_before_there_are_enough_trials_importances_say_nothing() -> None:
    ours = space(EPOCHS)
    alike = [Told({EPOCHS.path: 2 + number % 8}, "complete", 1.0) for number in range(12)]
    assert importances(ours, alike[:7]) == {}
    assert importances(ours, alike) == {}


@given(seed=st.integers(0, 2**31 - 1), number=st.integers(0, 200), sampler=st.sampled_from(["random", "quasi", "tpe"]))
def test_every_proposal_is_within_its_ranges(seed: int, number: int, sampler: SamplerName) -> None:
    ours = space(RATE, EPOCHS, SCHEDULE)
    told = [Told({RATE.path: 1e-3, EPOCHS.path: 4, SCHEDULE.path: "linear"}, "failed")] * number
    values = propose(ours, sampler, seed, told)
    assert 1e-4 <= as_number(values[RATE.path]) <= 1e-2
    assert values[EPOCHS.path] in range(2, 10)
    assert type(values[EPOCHS.path]) is int
    assert values[SCHEDULE.path] in ("linear", "constant")
    assert ours.training(values).algorithm.name == "ppo"


def test_a_number_that_is_not_set_may_have_a_range() -> None:
    falling = space(RangedSetting(kind="range", path="algorithm.final_std", low=0.05, high=0.5, log=True, points=3))
    falling.check()
    algorithm = falling.training({"algorithm.final_std": 0.1}).algorithm
    assert isinstance(algorithm, PpoConfig)
    assert algorithm.final_std == 0.1


@pytest.mark.parametrize("sampler", ["tpe", "random", "quasi", "grid"])
def test_layers_and_the_weight_of_a_penalty_are_searched_by_every_sampler(sampler: SamplerName) -> None:
    """By ratio, the weight's: half of it lies between -100 and -25, a quarter each side of -50."""
    ours = Space(TrainingConfig(algorithm=PpoConfig(network=MlpNetwork())).model_dump(mode="json"), [LAYERS, COLLISION])
    ours.check()
    assert grid_values(ours, COLLISION) == pytest.approx([-400.0, -100.0, -25.0])
    told: list[Told] = []
    for _ in range(9 if sampler == "grid" else 32):
        values = propose(ours, sampler, 0, told)
        algorithm = (training := ours.training(values)).algorithm
        assert isinstance(algorithm, PpoConfig)
        assert isinstance(algorithm.network, MlpNetwork)
        assert list(algorithm.network.hidden_sizes) == values[LAYERS.path]
        assert -400.0 <= training.task.reward.terms[1].weight <= -25.0
        told.append(Told(values, "complete", training.task.reward.weight("collision")))
    tried = [str(one.values[LAYERS.path]) for one in told]
    assert set(tried) == {"[64, 64]", "[128, 128]", "[256]"}
    if sampler == "tpe":
        late = [one.score for one in told[16:] if one.score is not None]
        assert sum(score > -100.0 for score in late) > len(late) // 2
    elif sampler != "grid":
        assert 10 <= sum(one.score is not None and one.score > -100.0 for one in told) <= 22
    assert importances(ours, told).keys() == ({LAYERS.path, COLLISION.path} if len(told) >= 8 else set())


def test_a_grid_takes_every_combination_once_in_a_drawn_order() -> None:
    ours = space(RATE, EPOCHS, SCHEDULE)
    assert grid_values(ours, RATE) == pytest.approx([1e-4, 1e-3, 1e-2])
    # A third of the way from 2 to 9 is 4.33.
    assert grid_values(ours, EPOCHS) == [2, 4, 7, 9]
    assert grid_size(ours) == 24
    points = [grid_point(ours, 3, number) for number in range(24)]
    assert len({tuple(point.values()) for point in points}) == 24
    assert points != [grid_point(ours, 4, number) for number in range(24)]


def test_quasi_random_points_fill_the_space_evenly() -> None:
    ours = space(RATE, EPOCHS, SCHEDULE)
    points = [quasi_point(ours, 0, number) for number in range(16)]
    assert sorted(as_number(point[EPOCHS.path]) for point in points) == [epochs for epochs in range(2, 10) for _ in range(2)]
    assert sum(point[SCHEDULE.path] == "linear" for point in points) == 8
    assert sum(as_number(point[RATE.path]) < 1e-3 for point in points) == 8


def test_success_comes_first_then_time() -> None:
    # An episode of 200 more with one of three seeds outweighs all of the time.
    assert score(0.8 + 1 / 600, None, 100.0) > score(0.8, 0.0, 100.0)
    assert score(0.8, 10.0, 100.0) > score(0.8, 11.0, 100.0) > score(0.8, None, 100.0)


@pytest.mark.parametrize(
    ("values", "mean"),
    [([0.3], 0.3), ([0.0, 0.3, 0.9], 0.4), ([0.0, 0.4, 0.6, 1.0], 0.5), ([0.0, 0.1, 0.2, 0.3, 1.0], 0.2)],
)
def test_the_interquartile_mean(values: list[float], mean: float) -> None:
    assert interquartile_mean(values) == pytest.approx(mean)
    assert interquartile_mean(values[::-1]) == pytest.approx(mean)


def trial(*by_seed: list[float | None]) -> dict[str, list[float | None]]:
    return {str(seed): rates for seed, rates in enumerate(by_seed)}


# At the second evaluation 0.2, 0.4, 0.6 and 0.8: the median is 0.5.
COMPLETE = [trial([0.1, rate], [0.1, rate], [0.1, rate]) for rate in (0.2, 0.4, 0.6, 0.8)]


@pytest.mark.parametrize(
    ("now", "stops"),
    [
        (trial([0.1, 0.49], [0.1, 0.49], []), True),
        (trial([0.1, 0.5], [0.1, 0.5], []), False),
        # Its best until there counts.
        (trial([0.6, 0.3], [0.6, 0.3], []), False),
        # One seed alone has got there; with two at the first evaluation it is level.
        (trial([0.1, 0.0], [0.1], []), False),
        (trial([0.0, 0.0], [0.0], []), True),
        (trial([], [], []), False),
        (trial([None, 0.49], [None, 0.49], []), True),
    ],
)
def test_the_median_rule(now: dict[str, list[float | None]], stops: bool) -> None:
    assert (hopeless(now, COMPLETE, 1) is not None) == stops


def test_the_median_rule_waits_for_enough_trials_and_steps() -> None:
    bad = trial([0.0, 0.0], [0.0, 0.0], [0.0, 0.0])
    assert hopeless(bad, COMPLETE, 2) is not None
    assert hopeless(bad, COMPLETE, 3) is None
    assert hopeless(bad, COMPLETE[:3], 2) is None


def test_the_median_is_of_the_same_seeds() -> None:
    """Seed 2 is the easy one: a trial that has it not yet is not held against those that have."""
    complete = [trial([0.3], [0.3], [0.9])] * 4
    assert hopeless(trial([0.3], [0.3], []), complete, 1) is None


def test_success_on_the_way() -> None:
    assert rungs_of(trial([0.2, 0.6], [0.4], [None, 0.8])) == pytest.approx({1: 0.3, 2: 0.7})


def test_the_front_of_cost_against_success() -> None:
    points = [(100.0, 0.5), (50.0, 0.4), (60.0, 0.4), (200.0, 0.5), (300.0, 0.9)]
    trials = [
        StudyTrial(number=number, state="complete", cost=cost, success=success)
        for number, (cost, success) in enumerate(points)
    ]
    assert front(trials) == [2, 1, 5]
