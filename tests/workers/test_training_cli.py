"""`mapless train`, `evaluate` and `export`: the same code as the service's, and mistakes answered in one line."""

import json
import os
import re
import signal
import subprocess
import sys
import zipfile
from pathlib import Path

import onnxruntime
import pytest
from typer.testing import CliRunner

from workers.checkpoints import read_manifest
from workers.cli import app
from workers.config import DdpgConfig, TrainingConfig

TINY = TrainingConfig.model_validate(
    {
        "steps": 2_000,
        "algorithm": {"name": "ppo", "robots": 32, "rollout_steps": 16, "minibatch_size": 128, "epochs": 1},
    }
)


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "training.json"
    path.write_text(TINY.model_dump_json())
    return path


@pytest.fixture
def checkpoint(tmp_path: Path, config: Path) -> Path:
    result = CliRunner().invoke(app, ["train", "--config", str(config), "--seed", "3", "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    return tmp_path / "step-2048.zip"


def test_train_writes_a_checkpoint_of_what_was_asked(checkpoint: Path) -> None:
    manifest = read_manifest(checkpoint)
    assert manifest.training == TINY
    assert manifest.seed == 3


def test_resume_goes_on_with_its_own_configuration(tmp_path: Path, checkpoint: Path) -> None:
    result = CliRunner().invoke(
        app, ["train", "--resume", str(checkpoint), "--steps", "3000", "--out", str(tmp_path / "more")]
    )
    assert result.exit_code == 0, result.output
    manifest = read_manifest(tmp_path / "more" / "step-3072.zip")
    assert manifest.seed == 3
    assert manifest.training == TINY.model_copy(update={"steps": 3000})


def test_options_change_the_preset_part_by_part(tmp_path: Path) -> None:
    options = ["--algorithm", "ddpg", "--network", "resblock", "--arena", "complex", "--observation", "paper"]
    result = CliRunner().invoke(app, ["train", *options, "--steps", "1000", "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    training = read_manifest(tmp_path / "step-1024.zip").training
    assert isinstance(training.algorithm, DdpgConfig)
    assert training.algorithm.network.name == "resblock"
    assert (training.task.arena.name, training.task.observation.in_short) == ("complex", "paper")


def test_evaluate_prints_success_with_its_interval(checkpoint: Path) -> None:
    result = CliRunner().invoke(app, ["evaluate", str(checkpoint), "--suite", "complex-200"])
    assert result.exit_code == 0, result.output
    assert re.search(r"% success \[\d+\.\d%, \d+\.\d%\] of 200 on complex-200", result.output.replace("\n", " "))


def test_evaluate_names_each_of_several_checkpoints(tmp_path: Path, checkpoint: Path) -> None:
    other = tmp_path / "other.zip"
    other.write_bytes(checkpoint.read_bytes())
    result = CliRunner().invoke(app, ["evaluate", str(checkpoint), str(other)])
    assert result.exit_code == 0, result.output
    first, second = result.output.splitlines()
    assert first.startswith(f"{checkpoint}: ")
    assert second.startswith(f"{other}: ")
    assert first.removeprefix(f"{checkpoint}") == second.removeprefix(f"{other}")  # the same policy, the same scenarios


def test_evaluate_tells_what_several_seeds_say_together(tmp_path: Path, checkpoint: Path) -> None:
    """The same weights as two other seeds, and an older checkpoint of one of them, which does not count."""
    options = ["evaluate", str(checkpoint)]
    for name, seed, step in (("one", 4, 2_000), ("old", 4, 1_000), ("two", 5, 2_000)):
        archive = tmp_path / f"{name}.zip"
        with zipfile.ZipFile(checkpoint) as original, zipfile.ZipFile(archive, "w") as copy:
            for entry in original.namelist():
                content = original.read(entry)
                if entry == "manifest.json":
                    content = json.dumps(json.loads(content) | {"seed": seed, "step": step}).encode()
                copy.writestr(entry, content)
        options.append(str(archive))

    result = CliRunner().invoke(app, options)

    assert result.exit_code == 0, result.output
    *each, together = result.output.splitlines()
    assert len(each) == 4
    assert re.search(r"success \[\d+\.\d%, \d+\.\d%\] over 3 seeds on simple-200 \(.*%, .*%, .*%\)\. ", together)
    assert re.search("of 3 seeds failed|All 3 seeds failed|Even the best of 3 seeds arrives in", together)


def test_export_writes_onnx(tmp_path: Path, checkpoint: Path) -> None:
    result = CliRunner().invoke(app, ["export", str(checkpoint), "--format", "onnx", "--out", str(tmp_path / "policy.onnx")])
    assert result.exit_code == 0, result.output
    assert onnxruntime.InferenceSession(tmp_path / "policy.onnx").get_inputs()[0].shape == ["n", 16]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["train", "--steps", "5"], "steps"),
        (["train", "--algorithm", "dqn"], "algorithm"),
        (["train", "--preset", "nothing"], "choose one of default, paper, complex"),
        (["train", "--arena", "moon"], "arena"),
        (["evaluate", __file__], "not a readable archive"),
    ],
)
def test_mistakes_are_answered_in_words(tmp_path: Path, arguments: list[str], complaint: str) -> None:
    out = ["--out", str(tmp_path)] if arguments[0] == "train" else []
    result = CliRunner().invoke(app, [*arguments, *out])
    assert result.exit_code == 2
    assert complaint in result.output
    assert "Traceback" not in result.output


def test_unknown_suite_is_answered_in_words(checkpoint: Path) -> None:
    result = CliRunner().invoke(app, ["evaluate", str(checkpoint), "--suite", "nowhere-1"])
    assert result.exit_code == 2
    assert "simple-200" in result.output


def test_ctrl_c_leaves_a_checkpoint(tmp_path: Path, config: Path) -> None:
    long = json.loads(config.read_text()) | {"steps": 100_000_000, "evaluation": {"every_steps": 1_000}}
    config.write_text(json.dumps(long))
    program = "from workers.cli import app; app()"
    command = [sys.executable, "-c", program, "train", "--config", str(config), "--out", str(tmp_path / "out")]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2]), "COLUMNS": "200"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        assert "success" in process.stdout.readline()  # the first evaluation: training is under way
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    (line,) = re.findall(r"stopped: \S*step-(\d+)\.zip", output)
    assert read_manifest(tmp_path / "out" / f"step-{line}.zip").step == int(line)
