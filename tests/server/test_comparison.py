"""Experiments side by side: figures with what stands behind them, differences, warnings, curves on one grid."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from hypothesis import given
from hypothesis import strategies as st

from server.comparison.differences import differences
from server.comparison.grid import Curve, common_grid, resample
from server.database import tables
from server.metrics.axes import AxisRepository
from server.metrics.buckets import Buckets
from server.metrics.points import Points
from server.metrics.repository import MetricRepository
from tests.server.harness import Reports
from workers.reporting import EvaluationResult
from workers.statistics.seeds import success_rate


def compare(client: TestClient, *experiments: dict[str, Any]) -> dict[str, Any]:
    return compare_within(client, None, *experiments)


def compare_within(client: TestClient, margin: float | None, *experiments: dict[str, Any]) -> dict[str, Any]:
    params: dict[str, Any] = {"experiment": [experiment["id"] for experiment in experiments]}
    response = client.get("/api/compare", params=params if margin is None else params | {"margin": margin})
    assert response.status_code == 200, response.text
    comparison: dict[str, Any] = response.json()
    return comparison


def test_figures_stand_on_the_last_checkpoint_of_every_seed(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Corridor", seeds=(0, 1))
    for run, arrivals, steps in zip(experiment["runs"], (8, 6), (80, 100), strict=True):
        reports.checkpoint(run, 1_000, reports.evaluation(arrivals=1))
        reports.checkpoint(run, 2_000, reports.evaluation(arrivals=arrivals, steps=steps))

    (figures,) = compare(client, experiment)["experiments"]

    assert (figures["name"], figures["seeds"], figures["episodes"], figures["suite"]) == ("Corridor", 2, 20, "simple-200")
    expected, success = success_rate([8, 6], [10, 10]), figures["success"]
    assert (success["value"], success["low"], success["high"]) == (0.7, expected.low, expected.high)
    assert (success["unit"], success["seeds"], success["episodes"], success["per_seed"]) == ("seeds", 2, 20, [0.8, 0.6])
    assert success["failed"]["sentence"] == "None of 2 seeds failed: up to 78 % may (one-sided 95 %)."
    # Over the episodes that arrived, 8 and 6: seeds count alike.
    assert figures["steps_per_target"]["value"] == 90.0
    assert figures["steps_per_target"]["episodes"] == 14
    assert figures["steps_per_target"]["failed"] is None
    # Means of 60 and 20.
    assert figures["reward"]["value"] == pytest.approx(40.0)
    assert figures["reward"]["low"] < 40.0 < figures["reward"]["high"]


def test_what_differs_in_the_configuration_is_listed_by_its_path(client: TestClient, reports: Reports) -> None:
    one = reports.experiment(steps=5_000)
    other = reports.experiment(steps=6_000, algorithm={"name": "ppo", "network": {"name": "resblock"}})

    neither = [False, False]
    assert compare(client, one, other)["differences"] == [
        {"path": "algorithm.network.name", "values": ["mlp", "resblock"], "left_out": neither},
        {"path": "algorithm.network.hidden_sizes", "values": [[64, 64], None], "left_out": neither},
        {"path": "algorithm.network.activation", "values": ["relu", None], "left_out": neither},
        {"path": "steps", "values": [5_000, 6_000], "left_out": neither},
        {"path": "algorithm.network.concatenations", "values": [None, True], "left_out": neither},
    ]
    steps = {"path": "steps", "values": [6_000, 5_000], "left_out": neither}
    assert steps in compare(client, other, one)["differences"]


def test_a_part_or_a_term_that_one_has_is_left_out_in_the_other(client: TestClient, reports: Reports) -> None:
    one = reports.experiment()
    parts = [part for part in one["training"]["task"]["observation"]["parts"] if part["name"] != "speeds"]
    terms = [{"name": "arrival", "weight": 7.0}]
    other = reports.experiment(task={"observation": {"parts": parts}, "reward": {"terms": terms}})
    rows = {row["path"]: row for row in compare(client, one, other)["differences"]}
    assert rows["task.observation.parts.speeds.frames"]["left_out"] == [False, True]
    assert rows["task.reward.terms.progress.weight"]["left_out"] == [False, True]
    assert rows["task.reward.terms.arrival.weight"]["left_out"] == [False, False]


def test_the_same_configuration_does_not_differ(client: TestClient, reports: Reports) -> None:
    assert compare(client, reports.experiment("a"), reports.experiment("b", seeds=(1, 2)))["differences"] == []


names = st.sampled_from(["task", "arena", "steps"])
settings = st.recursive(
    st.integers(0, 3),
    lambda children: st.dictionaries(names, children, max_size=3),
    max_leaves=8,
)
configurations = st.dictionaries(names, settings, max_size=4)


@given(configurations, configurations)
def test_differences_are_symmetric_and_empty_for_equals(one: dict[str, Any], other: dict[str, Any]) -> None:
    assert differences([one, one]) == []
    forth = {row.path: row.values for row in differences([one, other])}
    back = {row.path: row.values[::-1] for row in differences([other, one])}
    assert forth == back


def test_unfinished_runs_are_said(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Corridor", seeds=(0, 1))
    assert compare(client, experiment)["warnings"] == ["Corridor has not been evaluated yet."]

    reports.checkpoint(experiment["runs"][0], 1_000, reports.evaluation(arrivals=10))
    assert compare(client, experiment)["warnings"] == [
        "1 of 2 runs of Corridor are not in its figures.",
        "Corridor is not finished: its figures are those of its newest checkpoints.",
    ]


def measured(
    reports: Reports, name: str, arrivals: Sequence[int], *, steps: int = 80, suite_hash: str = "hash-a"
) -> dict[str, Any]:
    """An experiment whose seeds arrived so often of 1,000 times."""
    experiment = reports.experiment(name, seeds=range(len(arrivals)))
    for run, arrived in zip(experiment["runs"], arrivals, strict=True):
        evaluation = reports.evaluation(arrivals=arrived, episodes=1_000, steps=steps, suite_hash=suite_hash)
        reports.checkpoint(run, 1_000, evaluation)
    return experiment


def test_a_verdict_has_a_direction(client: TestClient, reports: Reports) -> None:
    base = measured(reports, "base", (800, 820, 790, 850, 810), steps=100)
    good = measured(reports, "good", (990, 980, 970, 990, 980), steps=80)

    verdicts = compare(client, base, good)["verdicts"]
    assert [(one["measure"], one["word"]) for one in verdicts] == [("success", "better"), ("steps_per_target", "better")]
    assert {(one["base"], one["other"]) for one in verdicts} == {(base["id"], good["id"])}
    success, steps = verdicts
    assert success["difference"] == pytest.approx(0.982 - 0.814)
    assert success["low"] < success["difference"] < success["high"]
    assert success["margin"] == 0.02
    assert success["reason"].startswith("16.8 points more, 95 % interval [+")
    # Every arrival took as long: the seeds have no spread.
    assert (steps["difference"], steps["low"], steps["high"]) == (-20.0, -20.0, -20.0)
    assert steps["margin"] == pytest.approx(5.0)
    assert steps["reason"] == "20.0 steps to the target fewer, 95 % interval [-20.0, -20.0]."

    assert [one["word"] for one in compare(client, good, base)["verdicts"]] == ["worse", "worse"]


def test_a_verdict_of_equivalence_is_within_the_margin_that_is_asked_for(client: TestClient, reports: Reports) -> None:
    one = measured(reports, "one", (985, 980, 982, 978, 984))
    other = measured(reports, "other", (979, 984, 981, 983, 980))

    success, steps = compare(client, one, other)["verdicts"]
    assert (success["word"], steps["word"]) == ("equivalent", "equivalent")
    assert success["reason"].startswith("The two are equivalent within 2.0 points: 0.0 points less, 95 % interval [")
    narrow = compare_within(client, 0.001, one, other)["verdicts"][0]
    assert narrow["word"] == "not told"
    assert narrow["reason"].endswith("5 seeds show neither a direction nor equivalence within 0.1 points.")


def alternating(reports: Reports, name: str, hits: Sequence[str], steps: int = 80) -> dict[str, Any]:
    """An experiment whose every seed arrives where its text has a 1, in 10 scenarios."""
    experiment = reports.experiment(name, seeds=range(len(hits)))
    arrived, collided = reports.evaluation(1, 2, steps=steps).episodes
    for run, text in zip(experiment["runs"], hits, strict=True):
        rows = tuple(arrived if hit == "1" else collided for hit in text)
        reports.checkpoint(run, 1_000, EvaluationResult(suite="simple-200", suite_hash="hash-a", episodes=rows))
    return experiment


def test_the_same_scenarios_are_paired(client: TestClient, reports: Reports) -> None:
    """One arrives in five scenarios in which the other does not, and never the other way: 2 / 2 ** 5 = 0.0625."""
    base = alternating(reports, "base", ["1110000000"] * 5, steps=90)
    other = alternating(reports, "other", ["1111111100"] * 5, steps=80)

    success, steps = compare(client, base, other)["verdicts"]
    told = {"test": "randomisation", "scenarios": 10, "better": 5, "worse": 0, "p": pytest.approx(0.0625)}
    # Of two paired tests, 0.0625 is the smaller.
    assert success["paired"] == told | {"p_holm": pytest.approx(0.125)}
    # Both arrive in three scenarios, in all of them ten steps sooner: 2 / 2 ** 3.
    quicker = {"test": "signed rank", "scenarios": 3, "better": 3, "worse": 0, "p": pytest.approx(0.25)}
    assert steps["paired"] == quicker | {"p_holm": pytest.approx(0.25)}

    back, _ = compare(client, other, base)["verdicts"]
    assert (back["paired"]["better"], back["paired"]["worse"], back["p"]) == (0, 5, success["p"])


def test_many_comparisons_are_counted_and_their_p_adjusted(client: TestClient, reports: Reports) -> None:
    base = measured(reports, "base", (900, 880, 910, 890, 905))
    close = measured(reports, "close", (915, 912, 921, 910, 918))
    far = measured(reports, "far", (990, 985, 988, 991, 987))
    few = measured(reports, "few", (990,))

    comparison = compare(client, base, close, far, few)
    verdicts = comparison["verdicts"]
    ps = sorted(one["p"] for one in verdicts if one["word"] != "refused")
    assert comparison["comparisons"] == len(ps) == 4
    held = next(one for one in verdicts if one["other"] == close["id"] and one["measure"] == "success")
    assert held["p"] < held["p_holm"] == pytest.approx(held["p"] * (4 - ps.index(held["p"])))
    assert [(one["p"], one["p_holm"], one["paired"]) for one in verdicts if one["word"] == "refused"] == [(None,) * 3] * 2
    # A direction that so many comparisons may bring by chance says so.
    said = [one["reason"].endswith(f"(Holm: p = {one['p_holm']:.2g}).") for one in verdicts if one["word"] == "better"]
    assert said == [one["p_holm"] >= 0.05 for one in verdicts if one["word"] == "better"]


def test_what_has_seeds_enough_is_the_base_before_what_was_named_first(client: TestClient, reports: Reports) -> None:
    few, good = measured(reports, "few", (900, 880)), measured(reports, "good", (900, 880, 910, 890, 905))
    other = measured(reports, "other", (800, 780, 810, 790, 805))
    comparison = compare(client, few, good, other)
    assert comparison["base"] == good["id"]
    assert [one["word"] == "refused" for one in comparison["verdicts"] if one["measure"] == "success"] == [True, False]
    # Where none has, it is the first.
    assert compare(client, few, measured(reports, "fewer", (900,)))["base"] == few["id"]


def test_another_base_and_every_pair(client: TestClient, reports: Reports) -> None:
    ids = [measured(reports, name, (900,) * 5)["id"] for name in "abc"]

    def held(**query: Any) -> set[tuple[int, int]]:
        response = client.get("/api/compare", params={"experiment": ids} | query)
        assert response.status_code == 200, response.text
        return {(ids.index(one["base"]), ids.index(one["other"])) for one in response.json()["verdicts"]}

    assert held() == {(0, 1), (0, 2)}
    assert held(base=ids[2]) == {(2, 0), (2, 1)}
    assert held(pairs=True) == {(0, 1), (0, 2), (1, 2)}

    refused = client.get("/api/compare", params={"experiment": ids, "base": "nobody"})
    assert (refused.status_code, refused.json()["detail"]) == (
        400,
        "The base is none of the experiments that are compared.",
    )
    many = [reports.experiment()["id"] for _ in range(13)]
    assert client.get("/api/compare", params={"experiment": many, "pairs": True}).status_code == 400


def test_how_likely_one_improves_on_the_other(client: TestClient, reports: Reports) -> None:
    """Better in five scenarios of ten, alike in five: 0.5 + 0.5 * 0.5."""
    base = alternating(reports, "base", ["1110000000"] * 5)
    other = alternating(reports, "other", ["1111111100"] * 5)

    (improvement,) = compare(client, base, other)["improvements"]
    assert (improvement["base"], improvement["other"], improvement["value"]) == (base["id"], other["id"], 0.75)
    assert compare(client, base, alternating(reports, "few", ["1"] * 4))["improvements"] == []


def test_a_profile_falls_from_the_success_rate_to_nothing(client: TestClient, reports: Reports) -> None:
    """Arrivals drove 4 m where 3.5 m less the arrival distance is the shortest."""
    one, empty = alternating(reports, "one", ["1110000000", "1111100000"]), reports.experiment("empty")
    shortest = 3.5 - one["training"]["task"]["arrival_distance"]

    response = client.get("/api/compare/profiles", params={"experiment": [one["id"], empty["id"]]})
    assert response.status_code == 200, response.text
    profiles = response.json()
    filled, unfilled = profiles["experiments"]
    assert (profiles["thresholds"][0], profiles["thresholds"][-1]) == (0.0, 1.0)
    for threshold, mean in zip(profiles["thresholds"], filled["mean"], strict=True):
        assert mean == (pytest.approx(0.4) if threshold < shortest / 4.0 else 0.0)
    assert filled["low"][0] < 0.4 < filled["high"][0]
    assert (unfilled["seeds"], unfilled["mean"]) == (0, [])


def test_below_five_seeds_a_verdict_is_refused(client: TestClient, reports: Reports) -> None:
    five, four = measured(reports, "five", (500,) * 5), measured(reports, "four", (1_000,) * 4)

    for verdict in compare(client, five, four)["verdicts"]:
        assert (verdict["word"], verdict["difference"], verdict["low"], verdict["high"]) == ("refused", None, None, None)
        assert verdict["reason"] == "No verdict below 5 seeds: four has 4 to show."


def test_over_different_suites_a_verdict_is_refused(client: TestClient, reports: Reports) -> None:
    one, other = measured(reports, "one", (500,) * 5), measured(reports, "other", (900,) * 5, suite_hash="hash-b")

    verdict = compare(client, one, other)["verdicts"][0]
    assert verdict["word"] == "refused"
    assert verdict["reason"].startswith("No verdict over different suites")


def test_one_experiment_alone_has_no_verdict(client: TestClient, reports: Reports) -> None:
    assert compare(client, measured(reports, "one", (900,) * 5))["verdicts"] == []


def test_who_never_arrives_has_no_steps_to_judge(client: TestClient, reports: Reports) -> None:
    one, other = measured(reports, "one", (900,) * 5), measured(reports, "never", (0,) * 5)

    success, steps = compare(client, one, other)["verdicts"]
    assert (success["word"], steps["word"]) == ("worse", "refused")
    assert steps["reason"] == "No verdict below 5 seeds: never has 0 to show."


def test_five_seeds_that_are_done_need_no_warning(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment(seeds=range(5))
    for run in experiment["runs"]:
        reports.checkpoint(run, 1_000, reports.evaluation(arrivals=10))
        reports.state(run, "completed")

    assert compare(client, experiment)["warnings"] == []


def test_different_suites_are_never_counted_together(client: TestClient, reports: Reports) -> None:
    mixed = reports.experiment("Mixed", seeds=(0, 1, 2))
    for run, suite_hash, arrivals in zip(mixed["runs"], ("hash-a", "hash-b", "hash-b"), (0, 10, 10), strict=True):
        reports.checkpoint(run, 1_000, reports.evaluation(arrivals=arrivals, suite_hash=suite_hash))
    other = reports.experiment("Other")
    reports.checkpoint(other["runs"][0], 1_000, reports.evaluation(arrivals=10, suite_hash="hash-a"))

    comparison = compare(client, mixed, other)

    figures = comparison["experiments"][0]
    assert (figures["suite_hash"], figures["seeds"], figures["success"]["value"]) == ("hash-b", 2, 1.0)
    assert "They were measured on different suites: their figures can't be compared." in comparison["warnings"]
    # A list shows the same figure as the comparison.
    assert client.get(f"/api/experiments/{mixed['id']}").json()["success"] == figures["success"]


def test_an_experiment_without_arrivals_has_no_steps_per_target(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment()
    reports.checkpoint(experiment["runs"][0], 1_000, reports.evaluation(arrivals=0))

    (figures,) = compare(client, experiment)["experiments"]
    assert figures["success"]["value"] == 0.0
    assert figures["steps_per_target"] is None
    assert figures["reward"]["value"] == -100.0


def test_curves_stand_on_one_grid(client: TestClient, reports: Reports) -> None:
    one, other = reports.experiment("one", seeds=(0, 1)), reports.experiment("other")
    reports.metrics(one["runs"][0], "eval/success_rate", {100: 0.0, 300: 1.0})
    reports.metrics(one["runs"][1], "eval/success_rate", {100: 0.5, 200: 0.75})
    reports.metrics(other["runs"][0], "eval/success_rate", {400: 1.0})

    response = client.get("/api/compare/curves", params={"experiment": [one["id"], other["id"]]})

    assert response.status_code == 200
    curves = response.json()
    assert (curves["name"], curves["steps"]) == ("eval/success_rate", [100, 200, 300, 400])
    first, second = curves["experiments"]
    assert first["seeds"] == [
        {"seed": 0, "values": [0.0, 0.5, 1.0, None], "thinned": False},
        {"seed": 1, "values": [0.5, 0.75, None, None], "thinned": False},
    ]
    assert first["mean"] == [0.25, 0.625, 1.0, None]
    assert first["count"] == [2, 2, 1, 0]
    # Student's t on the logit: 0.625 with an error of 0.125, 0.125 / (0.625 * 0.375) = 0.5333, times 12.7062 is 6.777;
    # logit(0.625) = 0.5108.
    assert first["low"][1] == pytest.approx(1 / (1 + math.exp(6.777 - 0.5108)), abs=1e-4)
    assert first["high"][1] == pytest.approx(1 / (1 + math.exp(-6.777 - 0.5108)), abs=1e-4)
    assert (first["low"][2:], first["high"][2:]) == ([None, None], [None, None])
    assert second["mean"] == [None, None, None, 1.0]


def test_the_band_of_other_metrics_is_students_t(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment(seeds=(0, 1))
    for run, value in zip(experiment["runs"], (1.0, 3.0), strict=True):
        reports.metrics(run, "train/return", {100: value})

    parameters = {"experiment": experiment["id"], "name": "train/return"}
    (curve,) = client.get("/api/compare/curves", params=parameters).json()["experiments"]
    # Mean 2, error 1, one degree of freedom.
    assert (curve["low"], curve["high"]) == ([pytest.approx(2 - 12.7062)], [pytest.approx(2 + 12.7062)])


def test_seeds_that_all_arrive_still_have_a_band(client: TestClient, reports: Reports) -> None:
    """Both evaluated on a suite of 10: 20 of 20 leave 1 - 0.025 ** (1 / 20) open."""
    experiment = reports.experiment(seeds=(0, 1))
    for run in experiment["runs"]:
        reports.metrics(run, "eval/success_rate", {100: 1.0})
        reports.checkpoint(run, 100, reports.evaluation(arrivals=10))

    parameters = {"experiment": experiment["id"], "name": "eval/success_rate"}
    (curve,) = client.get("/api/compare/curves", params=parameters).json()["experiments"]
    assert (curve["low"], curve["high"]) == ([pytest.approx(0.025 ** (1 / 20))], [1.0])


def test_a_chart_asks_for_so_many_lines_and_means_are_of_all_runs(client: TestClient, reports: Reports) -> None:
    one, other = (reports.experiment(name, seeds=(0, 1, 2)) for name in ("one", "other"))
    for seed, run in enumerate(one["runs"]):
        reports.metrics(run, "train/return", {100: float(seed)})
    ids = [one["id"], other["id"]]
    parameters = {"experiment": ids, "name": "train/return", "lines": 4}

    first, second = client.get("/api/compare/curves", params=parameters).json()["experiments"]

    assert [len(each["seeds"]) for each in (first, second)] == [2, 2]
    assert (first["mean"], first["count"]) == ([1.0], [3])
    everything = client.get("/api/compare/curves", params={"experiment": ids, "name": "train/return"}).json()
    assert [len(each["seeds"]) for each in everything["experiments"]] == [3, 3]


def test_long_curves_are_resampled(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment()
    reports.metrics(experiment["runs"][0], "train/return", {step: float(step) for step in range(0, 1_001, 10)})

    parameters = {"experiment": experiment["id"], "name": "train/return", "points": 5}
    curves = client.get("/api/compare/curves", params=parameters).json()

    assert curves["steps"] == [0, 250, 500, 750, 1_000]
    assert curves["experiments"][0]["mean"] == [0.0, 250.0, 500.0, 750.0, 1_000.0]


def test_a_metric_that_nobody_reported_is_an_empty_curve(client: TestClient, reports: Reports) -> None:
    parameters = {"experiment": reports.experiment()["id"], "name": "nothing"}
    curves = client.get("/api/compare/curves", params=parameters).json()

    assert curves["steps"] == []
    assert curves["experiments"][0]["mean"] == []


series = st.lists(
    st.tuples(st.integers(0, 10_000), st.floats(-1e3, 1e3, width=32)), unique_by=lambda p: p[0], min_size=1, max_size=40
).map(sorted)


@given(st.lists(series, min_size=1, max_size=4), st.integers(2, 30), st.booleans(), st.booleans())
def test_resampling_stays_within_each_curve(
    curves: list[list[tuple[int, float]]], limit: int, whole: bool, logarithmic: bool
) -> None:
    points = [Buckets.of(Points.of([p[0] for p in curve], [0.0] * len(curve), [p[1] for p in curve])) for curve in curves]
    found = [Curve.over_steps(each) for each in points]
    grid = common_grid(found, limit, whole=whole, logarithmic=logarithmic).x

    assert grid.size <= limit
    assert (np.diff(grid) > 0).all()
    assert not logarithmic or (grid > 0).all()
    for curve in found:
        values = resample(curve, grid)
        inside = (grid >= curve.x[0]) & (grid <= curve.x[-1])
        assert (np.isfinite(values) == inside).all()
        assert (values[inside] >= curve.y.min() - 1e-3).all()
        assert (values[inside] <= curve.y.max() + 1e-3).all()


def counted(reports: Reports, run: dict[str, Any], name: str, counter: str, points: dict[int, tuple[float, float]]) -> None:
    """Report a metric beside what was counted, as (count, value) by step."""
    reports.rows(run, {step: {counter: count, name: value} for step, (count, value) in points.items()})


@pytest.mark.parametrize(("second_ends", "mean_at_40_s"), [(200, 30.0), (300, None)], ids=["cut short", "done first"])
def test_means_over_time_are_taken_where_each_seed_has_got_to(
    client: TestClient, reports: Reports, second_ends: int, mean_at_40_s: float | None
) -> None:
    """By hand. Seed 0, which rested overnight after step 200, goes 10, 20, 40 s; seed 1 is quicker.

    At 10 s seed 1 is a quarter of its way from 2 to 6, at 20 s three quarters; at 25 s seed 0 is a quarter of the way from
    10 to 30. At 5 s seed 0 has not reported yet: there is no mean. At 40 s seed 1 has ended: where it was cut short, seed 0
    goes on alone; where it had all its steps, the mean of both ends with it.
    """
    experiment = reports.experiment(seeds=(0, 1, 2))
    first, second, old = experiment["runs"]
    counted(reports, first, "train/return", "time/wall_seconds", {100: (10, 0.0), 200: (20, 10.0), 300: (40, 30.0)})
    counted(reports, second, "train/return", "time/wall_seconds", {100: (5, 2.0), second_ends: (25, 6.0)})
    reports.metrics(old, "train/return", {100: 1.0, 200: 9.0})

    asked = {"experiment": experiment["id"], "name": "train/return", "x": "wall"}
    curves = client.get("/api/compare/curves", params=asked).json()

    assert (curves["across"], curves["spacing"], curves["steps"]) == ("wall", "points", [])
    assert curves["x"] == [5.0, 10.0, 20.0, 25.0, 40.0]
    (curve,) = curves["experiments"]
    assert [seed["values"] for seed in curve["seeds"]] == [
        [None, 0.0, 10.0, 15.0, 30.0],
        [2.0, 3.0, 5.0, 6.0, None],
        [None] * 5,
    ]
    assert curve["mean"] == [None, 1.5, 7.5, 10.5, mean_at_40_s]
    assert curve["count"] == [1, 2, 2, 2, 1]
    # Student's t of 10 and 5: an error of 2.5 times 12.7062.
    assert curve["low"][2] == pytest.approx(7.5 - 2.5 * 12.7062, abs=1e-3)
    assert (curve["low"][0], curve["high"][4]) == (None, None)
    # Its trainer had not counted the time: nobody guesses it.
    assert curve["unplaced"] == 1


def test_many_points_over_time_are_looked_at_evenly_or_by_equal_factors(client: TestClient, reports: Reports) -> None:
    run = (experiment := reports.experiment())["runs"][0]
    counted(reports, run, "train/reward", "train/episodes", {step: (step - 1, step - 1.0) for step in range(1, 1_002)})
    asked = {"experiment": experiment["id"], "name": "train/reward", "x": "episodes", "points": 4}

    even = client.get("/api/compare/curves", params=asked).json()
    assert (even["spacing"], even["x"]) == ("even", [0.0, 333.3333, 666.6667, 1_000.0])
    assert even["experiments"][0]["mean"] == pytest.approx(even["x"])

    # 0 has no place on a logarithmic axis: from 1 on, tenfold each time.
    factors = client.get("/api/compare/curves", params=asked | {"log": True}).json()
    assert (factors["spacing"], factors["x"]) == ("logarithmic", [1.0, 10.0, 100.0, 1_000.0])
    assert factors["experiments"][0]["mean"] == pytest.approx(factors["x"])


def test_over_cpu_time_only_two_series_are_read_and_the_long_ones_by_their_summaries(
    client: TestClient, reports: Reports, monkeypatch: pytest.MonkeyPatch
) -> None:
    """20,000 points, 10 seconds for every thousand steps: what is drawn lies on that line, and no chunk is decoded."""
    run = (experiment := reports.experiment())["runs"][0]
    steps = np.arange(1, 20_001, dtype=np.int64) * 100
    with reports.services.database.write() as session:
        MetricRepository(session).add_series(
            run["id"],
            {
                name: Points(steps, np.zeros(steps.size), (steps * factor).astype(np.float32))
                for name, factor in (("time/cpu_seconds", 0.01), ("loss/value", 1.0), ("loss/policy", 2.0))
            },
        )
    decoded: list[str] = []
    decode = AxisRepository.decoded

    def seen(self: AxisRepository, chunks: Iterable[tables.MetricChunk]) -> Iterator[tuple[tables.MetricChunk, Points]]:
        for chunk, points in decode(self, chunks):
            decoded.append(chunk.name)
            yield chunk, points

    monkeypatch.setattr(AxisRepository, "decoded", seen)
    asked = {"experiment": experiment["id"], "name": "loss/value", "x": "cpu", "points": 50}
    curves = client.get("/api/compare/curves", params=asked).json()

    assert decoded == []
    assert (len(curves["x"]), curves["x"][-1]) == (50, 20_000.0)
    values = curves["experiments"][0]["mean"]
    # A point of a summary is the mean of its bucket, at the bucket's end: half a bucket of 16 points behind.
    assert values == pytest.approx([100 * x for x in curves["x"]], abs=16 * 100)


def test_what_the_runs_have_reported(client: TestClient, reports: Reports) -> None:
    one, other = reports.experiment("one", seeds=(0, 1)), reports.experiment("other")
    for run in one["runs"]:
        reports.rows(run, {100: {"train/return": 1.0, "time/wall_seconds": 2.0}})
    reports.metrics(other["runs"][0], "train/return", {100: 1.0})

    told = client.get("/api/compare/metrics", params={"experiment": [one["id"], other["id"]]}).json()
    assert told == {
        "runs": 3,
        "metrics": [{"name": "time/wall_seconds", "runs": 2}, {"name": "train/return", "runs": 3}],
    }


@pytest.mark.parametrize("path", ["/api/compare", "/api/compare/curves", "/api/compare/metrics", "/api/compare/profiles"])
def test_what_cannot_be_compared(client: TestClient, reports: Reports, path: str) -> None:
    assert client.get(path).status_code == 422
    assert client.get(path, params={"experiment": [reports.experiment()["id"], "nobody"]}).status_code == 404
    assert client.get(path, params={"experiment": [str(i) for i in range(51)]}).status_code == 422


def test_fifty_are_compared_and_more_are_refused_in_a_sentence(client: TestClient, reports: Reports) -> None:
    ids = [reports.experiment(f"Training {number}", seeds=(0,))["id"] for number in range(51)]
    parameters = [("experiment", one) for one in ids]

    for path in ("", "/metrics", "/profiles", "/curves"):
        answer = client.get(f"/api/compare{path}", params=parameters[:50])
        assert answer.status_code == 200, path
        assert path == "/metrics" or len(answer.json()["experiments"]) == 50
    assert len(client.get("/api/compare", params=parameters[:50]).json()["verdicts"]) >= 49

    refused = client.get("/api/compare", params=parameters)
    assert refused.status_code == 422
    assert len(refused.text) < 2_000
    in_pairs = client.get("/api/compare", params=[*parameters[:50], ("pairs", "true")])
    assert in_pairs.status_code == 400
    assert "12 experiments at most" in in_pairs.json()["detail"]
