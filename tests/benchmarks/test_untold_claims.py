"""The experiments beside the paper's campaign: what they measure, on numbers worked by hand, and that they can be run."""

import json
import math
from pathlib import Path

import pytest
import torch
from torch import nn

from benchmarks.untold_claims import adaptation, observation
from benchmarks.untold_claims.stability import flow
from benchmarks.untold_claims.trainings import Trainings
from benchmarks.untold_claims.words import ratio_of_spreads
from workers.config import EvaluationConfig, MlpNetwork, PpoConfig
from workers.reproduction.recorder import METRICS
from workers.reproduction.results import SeedResult
from workers.reproduction.rows import ROW_BY_ID
from workers.training.table import TableRow


def test_flow_is_the_first_layers_gradient_over_the_last_ones() -> None:
    """y = 2 (0.5 x): with x = 4 the gradient is 2 x = 8 in the first layer and 0.5 x = 2 in the last, a fourth of it."""
    first, last = nn.Linear(1, 1, bias=False), nn.Linear(1, 1, bias=False)
    nn.init.constant_(first.weight, 0.5)
    nn.init.constant_(last.weight, 2.0)
    network = nn.Sequential(first, last)
    assert flow(network, torch.full((3, 1), 4.0)) == pytest.approx(math.log10(4.0))


def test_what_was_learned_is_the_mean_of_the_evaluations_after_the_change(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "seed-0"
    folder.mkdir(parents=True)
    rates = {0: 0.9, 25_088: 0.2, 50_176: 0.4, 75_008: 1.0}
    lines = [json.dumps({"step": step, "eval/success_rate": rate}) for step, rate in rates.items()]
    (folder / METRICS).write_text("\n".join(lines))
    trainings = Trainings(tmp_path, 1)
    assert trainings.at_first("a") == [0.9]
    assert trainings.learned("a", 50_000, 25_000) == [pytest.approx(0.3)]


def test_the_ratio_of_two_spreads_has_the_interval_of_the_f_distribution() -> None:
    """Deviations 0.2 and 0.1 of five seeds each: F = 4, its quantiles with 4 and 4 degrees of freedom 9.604 and 0.1041."""

    def seeds(reach: float) -> list[SeedResult]:
        rates = [0.5 + reach * place for place in (-2, -1, 0, 1, 2)]
        rows = [TableRow(reward=1.0, episodes=90, success=rate, collisions=0.0, steps=100) for rate in rates]
        return [SeedResult(seed=at, steps=1_000, measured=row, learned_at=None) for at, row in enumerate(rows)]

    assert ratio_of_spreads(seeds(0.2), seeds(0.1)) == "2.00 times, 95 % interval [0.65, 6.20]."


def test_every_part_of_the_papers_observation_is_left_out_once_and_the_arena_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The real thing with 4,096 steps: nothing is learned, every table is whole, and the second run trains nothing."""
    algorithm = PpoConfig(network=MlpNetwork(hidden_sizes=(8,)), robots=32, rollout_steps=16, minibatch_size=256, epochs=1)
    evaluation = EvaluationConfig(every_steps=4_096, drives=1, drive_steps=400)
    tiny = {
        name: row.model_copy(
            update={
                "training": row.training.model_copy(
                    update={"algorithm": algorithm, "steps": 4_096, "evaluation": evaluation}
                )
            }
        )
        for name, row in ROW_BY_ID.items()
    }
    monkeypatch.setattr(observation, "ROW_BY_ID", tiny)
    monkeypatch.setattr(adaptation, "ROW_BY_ID", tiny)
    monkeypatch.setattr(adaptation, "AFTER_CHANGE", 4_096)
    monkeypatch.setattr(adaptation, "EVALUATE_EVERY", 4_096)

    trainings = Trainings(tmp_path, 2)
    parts = list(observation.observation(trainings))
    assert [line.split(" | ")[0] for line in parts[-7:]] == [
        "| nothing",
        "| the ranges",
        "| the speeds",
        "| the target's distance",
        "| the target's direction",
        "| its own heading",
        "| the heading's deviation from the target",
    ]
    methods = list(adaptation.adaptation(trainings))[-3:]
    assert [line.split(" | ")[0] for line in methods] == ["| ResBlock PPO", "| Vanilla PPO", "| DDPG, logit penalty"]
    began = json.loads((tmp_path / "complex-basic-vanilla-ppo-after-simple" / "seed-1" / "training.json").read_text())
    assert began["start_from"]["name"] == "simple-basic-vanilla-ppo, seed 1"

    written = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*/*/result.json")}
    assert list(observation.observation(trainings)) == parts
    assert list(observation.observation(trainings, ("ranges", "heading")))[-1] == (
        "Not measured: the speeds, the target's distance, the target's direction, the heading's deviation from the target."
    )
    assert {path: path.stat().st_mtime_ns for path in tmp_path.glob("*/*/result.json")} == written
