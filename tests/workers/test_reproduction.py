"""The campaign covers the paper's tables, continues where it was, and says no more than its seeds can carry."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.config import TaskConfig
from workers.config import EvaluationConfig, MlpNetwork, PpoConfig
from workers.reproduction.campaign import RESULT, RunResult, drive, reproduce, reproduce_one
from workers.reproduction.report import report
from workers.reproduction.rows import CLAIMS, ROWS, Row, TableRow
from workers.reproduction.verdict import bootstrap_difference, judge


def measured(*successes: float) -> list[TableRow]:
    return [TableRow(reward=10.0, episodes=90, success=success, steps=111.0) for success in successes]


def test_every_claim_compares_rows_that_exist() -> None:
    rows = {row.id: row for row in ROWS}
    assert len(rows) == len(ROWS) == 6
    for claim in CLAIMS:
        assert rows[claim.better].paper.success > rows[claim.worse].paper.success, "as the paper has it"


@pytest.mark.parametrize(
    ("better", "worse", "word"),
    [
        ((0.99, 0.98, 0.97, 0.99, 0.98), (0.80, 0.82, 0.79, 0.85, 0.81), "holds"),
        ((0.80, 0.82, 0.79, 0.85, 0.81), (0.99, 0.98, 0.97, 0.99, 0.98), "does not hold"),
        ((1.0, 1.0, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 1.0, 1.0), "does not hold"),  # no difference to speak of
        ((0.70, 0.95, 0.80, 0.90, 0.75), (0.72, 0.93, 0.85, 0.78, 0.80), "can't be told"),
        ((1.0, 1.0, 1.0, 1.0), (0.3, 0.3, 0.3, 0.3), "can't be told"),  # four seeds
    ],
)
def test_words_for_claims(better: Sequence[float], worse: Sequence[float], word: str) -> None:
    claim = CLAIMS[0]
    verdict = judge(claim, {claim.better: measured(*better), claim.worse: measured(*worse)})
    assert verdict.word == word


@given(st.lists(st.floats(0, 1), min_size=5, max_size=8), st.lists(st.floats(0, 1), min_size=5, max_size=8))
def test_interval_holds_the_difference_and_turns_with_it(better: list[float], worse: list[float]) -> None:
    low, high = bootstrap_difference(better, worse)
    assert low - 1e-9 <= np.mean(better) - np.mean(worse) <= high + 1e-9
    mirrored = bootstrap_difference(worse, better)
    assert mirrored == pytest.approx((-high, -low), abs=0.05)


def test_drive_counts_as_the_tables_do() -> None:
    """A robot that stands still: a time-out every 500 steps, no progress, no reward."""
    still = drive(lambda observations: np.zeros((len(observations), 2), np.float32), TaskConfig(), drives=3, steps=1_500)
    assert still == TableRow(reward=0.0, episodes=3.0, success=0.0, steps=500.0)


def tiny_row() -> Row:
    row = ROWS[1]
    algorithm = PpoConfig(network=MlpNetwork(hidden_sizes=(8,)), robots=32, rollout_steps=16, minibatch_size=256, epochs=1)
    training = row.training.model_copy(
        update={"algorithm": algorithm, "steps": 2_000, "evaluation": EvaluationConfig(every_steps=1_000)}
    )
    return row.model_copy(update={"training": training})


def test_done_work_is_not_done_again(tmp_path: Path) -> None:
    row = tiny_row()
    first = reproduce_one(row, 0, tmp_path)
    (archive,) = (tmp_path / row.id / "seed-0").glob("step-*.zip")
    assert archive.name == "step-2048.zip"  # the last one only
    # Trained, but killed before the result was written: nothing is trained again, and the result is the same.
    (tmp_path / row.id / "seed-0" / RESULT).unlink()
    before = archive.stat().st_mtime_ns
    assert reproduce_one(row, 0, tmp_path) == first
    assert archive.stat().st_mtime_ns == before
    archive.unlink()
    assert reproduce_one(row, 0, tmp_path) == first  # from the result alone


def test_campaign_runs_rows_side_by_side_and_reports(tmp_path: Path) -> None:
    row, told = tiny_row(), list[RunResult]()
    results = reproduce(tmp_path, seeds=2, jobs=2, rows=[row], on_result=told.append)
    assert sorted(result.seed for result in told) == [0, 1]
    assert len(results[row.id]) == 2
    page = report(results, "mapless reproduce", "2026-01-01")
    assert "| PPO | paper | 3.34 | 23 | 30.43 | 419.69 |" in page
    assert "ours, 2 seeds" in page
    assert page.count("**Can't be told**") == len(CLAIMS)
