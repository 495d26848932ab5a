"""The benchmark of studies, on a landscape that is computed in no time."""

import math
from pathlib import Path

import pytest

from benchmarks.studies import Result, Search, Trainings, measure, search, space_of
from workers.config import PpoConfig, TrainingConfig


class Landscape:
    """Success falls off around a step size of 0.001 and a discount of 0.97; counts what it was asked for."""

    def __init__(self) -> None:
        self.asked = 0

    def __call__(self, config: TrainingConfig, seed: int) -> Result:
        self.asked += 1
        algorithm = config.algorithm
        assert isinstance(algorithm, PpoConfig)
        away = abs(math.log10(algorithm.learning_rate) + 3) / 3 + abs(algorithm.gamma - 0.97) * 4
        return Result(max(0.0, 1.0 - away - 0.001 * seed), 10.0)


def test_what_was_trained_is_not_trained_again(tmp_path: Path) -> None:
    first, second = Landscape(), Landscape()
    space = space_of("simple", 9_000, 3)
    told = measure(Trainings(tmp_path / "all.jsonl", first), space, range(3), 4, 2)
    # Nine points with three seeds; two searches of each sampler, four trials with three seeds, and five judges each.
    assert first.asked <= 9 * 3 + 2 * 2 * (4 * 3 + 5)
    assert measure(Trainings(tmp_path / "all.jsonl", second), space, range(3), 4, 2) == told
    assert second.asked == 0


def test_an_interrupted_benchmark_goes_on_where_it_was(tmp_path: Path) -> None:
    space, whole = space_of("simple", 9_000, 3), Landscape()
    file = tmp_path / "some.jsonl"
    expected = search(Trainings(tmp_path / "whole.jsonl", whole), space, "tpe", 1, range(3), 15)
    search(Trainings(file, Landscape()), space, "tpe", 1, range(3), 6)
    rest = Landscape()
    assert search(Trainings(file, rest), space, "tpe", 1, range(3), 15) == expected
    assert rest.asked == whole.asked - 6 * 3


def test_the_best_of_a_grid_and_when_a_search_came_among_them(tmp_path: Path) -> None:
    assert Search([0.1, 0.5, 0.4, 0.9], {}).among(0.5) == 2
    assert Search([0.1, 0.5, 0.4, 0.9], {}).among(0.95) is None
    told = measure(Trainings(tmp_path / "all.jsonl", Landscape()), space_of("simple", 9_000, 10), range(3), 20, 1)
    assert told["grid_points"] == 100
    # The fifth of a hundred.
    assert told["grid_best"] >= told["grid_best_5_percent_from"] > 0.8
    assert told["tpe"]["mean_on_fresh_seeds"][0] == pytest.approx(told["tpe"]["success_on_fresh_seeds"][0], abs=1e-3)
