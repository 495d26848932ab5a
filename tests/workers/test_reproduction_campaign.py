"""The campaign on this machine: interrupted in every way, it goes on, and comes to the same result."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from workers.config import EvaluationConfig, MlpNetwork, PpoConfig, TrainingConfig
from workers.errors import OtherTrainingError
from workers.reproduction.campaign import reproduce
from workers.reproduction.curves import CURVE_BINS, binned
from workers.reproduction.kept import read_figures, write_figures
from workers.reproduction.outcome import SeedDone, Tick
from workers.reproduction.recorder import METRICS, Recorder, read_records
from workers.reproduction.report import write_report
from workers.reproduction.results import Progress, Trained
from workers.reproduction.rows import ROWS, Row
from workers.reproduction.training import RESULT, train_in
from workers.reproduction.verdict import judge_all

ROOT = Path(__file__).parents[2]


def tiny_training(steps: int = 2_000) -> TrainingConfig:
    algorithm = PpoConfig(network=MlpNetwork(hidden_sizes=(8,)), robots=32, rollout_steps=16, minibatch_size=256, epochs=1)
    evaluation = EvaluationConfig(every_steps=5_000, drives=2, drive_steps=600)
    return ROWS[1].training.model_copy(update={"algorithm": algorithm, "steps": steps, "evaluation": evaluation})


def tiny_row(steps: int = 2_000) -> Row:
    return ROWS[1].model_copy(update={"training": tiny_training(steps)})


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Trained:
    """What comes of 40,000 steps without an interruption."""
    trained = train_in(tmp_path_factory.mktemp("whole"), tiny_training(40_000), 3)
    assert trained is not None
    return trained


def test_a_training_is_measured_and_keeps_its_last_checkpoint(tmp_path: Path) -> None:
    told: list[Progress] = []
    trained = train_in(tmp_path, tiny_training(), 0, told.append)
    assert trained is not None
    assert trained.result.steps == 2_000
    assert trained.result.measured.episodes > 0
    assert [path.name for path in tmp_path.glob("step-*.zip")] == ["step-2048.zip"]
    assert told[-1].done == 1.0
    assert len(trained.curve) == len(trained.curve_steps) > 0


def test_done_work_is_not_done_again(tmp_path: Path) -> None:
    first = train_in(tmp_path, tiny_training(), 0)
    (archive,) = tmp_path.glob("step-*.zip")
    # Trained, but killed before the result was written: nothing is trained again, and the result is the same.
    (tmp_path / RESULT).unlink()
    before = archive.stat().st_mtime_ns
    assert train_in(tmp_path, tiny_training(), 0) == first
    assert archive.stat().st_mtime_ns == before
    archive.unlink()
    assert train_in(tmp_path, tiny_training(), 0) == first  # from the result alone


def test_a_killed_training_goes_on_to_the_same_result(tmp_path: Path, whole: Trained) -> None:
    script = (
        "from pathlib import Path; from tests.workers.test_reproduction_campaign import *;"
        f"train_in(Path({str(tmp_path)!r}), tiny_training(40_000), 3)"
    )
    process = subprocess.Popen([sys.executable, "-c", script], cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)})
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob("step-*.zip")):
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.01)
    process.kill()
    process.wait()
    assert not (tmp_path / RESULT).exists()
    told: list[Progress] = []
    again = train_in(tmp_path, tiny_training(40_000), 3, told.append)
    assert again is not None
    assert told[0].before > 0.0
    assert again.result == whole.result


def test_a_stopped_training_leaves_a_checkpoint_and_no_result(tmp_path: Path, whole: Trained) -> None:
    updates = iter(range(100))
    assert train_in(tmp_path, tiny_training(40_000), 3, stop_requested=lambda: next(updates) >= 5) is None
    assert [path.name for path in tmp_path.glob("step-*.zip")] == ["step-2560.zip"]
    again = train_in(tmp_path, tiny_training(40_000), 3)
    assert again is not None
    assert again.result == whole.result


def test_the_record_drops_what_the_checkpoint_does_not_hold_and_a_torn_line(tmp_path: Path) -> None:
    lines = [json.dumps({"step": step, "train/return": float(step)}) for step in (100, 200, 300)]
    (tmp_path / METRICS).write_text("\n".join(lines) + '\n{"step": 400, "tr')
    assert [record["step"] for record in read_records(tmp_path)] == [100, 200, 300]
    steps: list[int] = []
    recorder = Recorder(tmp_path, 200, steps.append, lambda: False)
    recorder.metrics(250, {"train/return": 2.5})
    assert [record["step"] for record in read_records(tmp_path)] == [100, 200, 250]
    assert steps == [250]


def test_a_folder_of_another_training_is_refused(tmp_path: Path) -> None:
    train_in(tmp_path, tiny_training(), 0)
    with pytest.raises(OtherTrainingError, match="other settings"):
        train_in(tmp_path, tiny_training(3_000), 0)


def test_a_campaign_runs_rows_side_by_side_tells_how_it_stands_and_reports(tmp_path: Path) -> None:
    exploding = tiny_training().algorithm.model_copy(update={"learning_rate": float("inf")})
    bad = ROWS[0].model_copy(update={"training": tiny_training().model_copy(update={"algorithm": exploding})})
    row, done, ticks = tiny_row(), list[SeedDone](), list[Tick]()
    outcome = reproduce(tmp_path / "campaign", seeds=2, jobs=2, rows=[row, bad], on_done=done.append, on_tick=ticks.append)
    assert sorted((one.row, one.seed) for one in done) == sorted((one.id, seed) for one in (row, bad) for seed in (0, 1))
    assert ticks[-1].finished == ticks[-1].trainings == 4
    assert len(outcome.of_row(row.id)) == 2
    # What fails is told, and the others go on.
    assert outcome.of_row(bad.id) == []
    assert all("infinite or NaN" in (one.error or "") for one in outcome.done if one.row == bad.id)

    page = tmp_path / "docs" / "page.md"
    page.parent.mkdir()
    write_report(page, outcome, "mapless reproduce", "2026-01-01", "a machine")
    text = page.read_text()
    assert "| Vanilla PPO | paper | 3.34 | 23 | 30.43 | 419.69 | – | 30.43 |" in text
    assert "ours, 2 seeds" in text
    assert text.count("**Can't be told:**") == len(judge_all({}))
    assert text.count("With DDPG's logit penalty: **can't be told.**") == sum(
        one.other_way is not None for one in judge_all({})
    )
    assert "| | ours, logit penalty | not trained |" in text
    assert "Made by `mapless reproduce` on 2026-01-01: 4 trainings" in text
    assert f"- {bad.id} with seed 0 failed and is left out: the weights became" in text
    assert (page.parent / "images" / "reproduction.svg").read_text().startswith("<svg")


def test_rows_with_wide_intervals_get_more_seeds_and_no_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A training of 2,000 steps arrives by luck: its interval stays wide. Which rows are wide is tested with the claims."""
    row, other = tiny_row(), tiny_row().model_copy(update={"id": "told"})
    monkeypatch.setattr("workers.reproduction.widths.too_wide", lambda results: frozenset({row.id}))
    done, ticks = list[SeedDone](), list[Tick]()
    outcome = reproduce(tmp_path, seeds=1, jobs=1, at_most=4, rows=[row, other], on_done=done.append, on_tick=ticks.append)
    assert [one.result.seed for one in outcome.of_row(row.id)] == list(range(4))
    assert len(outcome.of_row(other.id)) == 1
    assert len(done) == 5, "nothing is trained twice"
    assert (ticks[-1].finished, ticks[-1].trainings) == (5, 5)
    assert ticks[-1].done == pytest.approx(1.0)


def test_what_was_trained_elsewhere_is_not_trained_again(tmp_path: Path) -> None:
    row = tiny_row(20_000)
    first = reproduce(tmp_path / "there", seeds=2, jobs=1, rows=[row])
    figures = tmp_path / "page.json"
    write_figures(figures, first, [row])

    known, seconds = read_figures(figures, [row])
    assert seconds == first.seconds
    done = list[SeedDone]()
    again = reproduce(tmp_path / "here", seeds=3, jobs=1, known=known, rows=[row], on_done=done.append)
    assert [one.seed for one in done] == [2]
    assert [one.result for one in again.of_row(row.id)][:2] == [one.result for one in first.of_row(row.id)]
    # Its curve is as it was drawn: thinned once, and not a second time.
    edges = np.linspace(0.0, 20_000, CURVE_BINS + 1)
    for before, after in zip(first.of_row(row.id), again.of_row(row.id), strict=False):
        drawn, again_drawn = (binned(one.curve_steps, one.curve, edges) for one in (before, after))
        np.testing.assert_allclose(again_drawn, drawn, atol=6e-4)
    write_figures(tmp_path / "again.json", first, [row])
    assert read_figures(tmp_path / "again.json", [row])[0] == known


def test_figures_of_other_settings_or_of_nothing_are_refused(tmp_path: Path) -> None:
    figures = tmp_path / "page.json"
    with pytest.raises(OtherTrainingError, match=r"page\.json holds no figures"):
        read_figures(figures, [tiny_row()])
    write_figures(figures, reproduce(tmp_path / "there", seeds=1, jobs=1, rows=[tiny_row()]), [tiny_row()])
    with pytest.raises(OtherTrainingError, match="trained with other settings"):
        read_figures(figures, [tiny_row(3_000)])


# The command with a campaign of one tiny row.
COMMAND = """
import sys
from functools import partial
from tests.workers.test_reproduction_campaign import tiny_row
from workers.cli import app
from workers.reproduction import campaign
campaign.reproduce = partial(campaign.reproduce, rows=[tiny_row(20_000)])
app(["reproduce", "--directory", sys.argv[1], "--seeds", "3", "--jobs", "1"])
"""


def test_ctrl_c_and_the_same_command_again(tmp_path: Path) -> None:
    command = [sys.executable, "-c", COMMAND, str(tmp_path)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        # The first training is through, the second is under way.
        assert any("success" in line for line in iter(process.stdout.readline, ""))
        process.send_signal(signal.SIGINT)
        process.stdout.read()
        assert process.stderr.read() == "mapless: interrupted: the same command goes on where it was\n"
    assert process.returncode == 1
    finished = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*/seed-*/result.json")}
    assert 1 <= len(finished) < 3

    again = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert again.returncode == 0, again.stderr
    assert len(list(tmp_path.glob("*/seed-*/result.json"))) == 3
    assert all(path.stat().st_mtime_ns == at for path, at in finished.items())
    assert "ours, 3 seeds" in (tmp_path / "report.md").read_text()
    assert len(json.loads((tmp_path / "report.json").read_text())["results"][ROWS[1].id]) == 3
