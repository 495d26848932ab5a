"""One training of a campaign in a folder of its own: begun, continued where it was interrupted, or found done."""

import re
import time
from collections.abc import Callable
from pathlib import Path

from pydantic import ValidationError

from workers.checkpoints import read_policy
from workers.config import TrainingConfig
from workers.errors import ArchiveError, OtherTrainingError
from workers.reproduction.recorder import Recorder, evaluations, read_records, series
from workers.reproduction.results import Progress, SeedResult, Trained, learned_at
from workers.reproduction.rows import CURVE
from workers.training.table import TableRow
from workers.training.trainer import train

RESULT = "result.json"
_TRAINING = "training.json"


def train_in(
    folder: Path,
    training: TrainingConfig,
    seed: int,
    told: Callable[[Progress], None] = lambda _: None,
    stop_requested: Callable[[], bool] = lambda: False,
    start: Path | None = None,
) -> Trained | None:
    """Trains and measures; done work is not done again.

    Args:
        folder: of this training alone.
        training: what.
        seed: with which.
        told: of its progress.
        stop_requested: asked between updates.
        start: the archive of `training.start_from`, needed where that is set.

    Returns:
        The result; None where it was asked to stop, with a checkpoint to go on from.

    Raises:
        OtherTrainingError: the folder is that of another training.
        TrainingError: it cannot go on.
    """
    _claim(folder, training)
    done = folder / RESULT
    if done.exists():
        return Trained.model_validate_json(done.read_text())
    begun = time.monotonic()
    archive, before = _last_checkpoint(folder)

    def tell(step: int) -> None:
        part = min(1.0, step / training.steps)
        told(Progress(before=min(1.0, before / training.steps), done=part, seconds=time.monotonic() - begun))

    recorder = Recorder(folder, before if archive else -1, tell, stop_requested)
    if train(training, seed, recorder, folder, archive, start) == "stopped":
        return None
    trained = _read(folder, training, seed)
    partial = done.with_suffix(".part")
    partial.write_text(trained.model_dump_json(indent=2))
    partial.replace(done)
    return trained


def _claim(folder: Path, training: TrainingConfig) -> None:
    """Writes down what is trained here, or sees that it is this."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / _TRAINING
    if path.exists() and _settings(path) != training:
        raise OtherTrainingError(
            f"{folder} holds a training with other settings: go on with those, or choose another directory"
        )
    path.write_text(training.model_dump_json(indent=2))


def _settings(path: Path) -> TrainingConfig | None:
    """What was written down there; None where this version can't read it."""
    try:
        return TrainingConfig.model_validate_json(path.read_text())
    except ValidationError:
        return None


def _read(folder: Path, training: TrainingConfig, seed: int) -> Trained:
    records = read_records(folder)
    measured = TableRow.from_metrics(records[-1])
    assert measured is not None, "a completed training has reported its drives"
    result = SeedResult(seed=seed, steps=training.steps, measured=measured, learned_at=learned_at(*evaluations(records)))
    steps, values = series(records, CURVE)
    return Trained(result=result, curve_steps=tuple(steps), curve=tuple(values))


def _last_checkpoint(folder: Path) -> tuple[Path | None, int]:
    """The newest archive that is whole, and its step."""
    archives = {int(match[1]): path for path in folder.glob("step-*.zip") if (match := re.search(r"step-(\d+)", path.name))}
    for step in sorted(archives, reverse=True):
        try:
            read_policy(archives[step])
        except ArchiveError:
            continue
        return archives[step], step
    return None, 0
