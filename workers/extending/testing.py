"""What the tests of an extension train with: the real training, without the service."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.checkpoints import read_checkpoint
from workers.config import TrainingConfig
from workers.frames import Frame
from workers.reporting import EvaluationResult, EventLevel, WatchRequest
from workers.training.trainer import train as run


class _Reports:
    """A reporter that stops a training at a step."""

    def __init__(self, stop_at: int | None) -> None:
        self._stop_at = stop_at
        self._step = 0
        self.archive: Path | None = None

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """See `workers.reporting.Reporter`."""
        self._step = step

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """Nobody reads it."""

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """Remembers the newest."""
        self.archive = archive

    def frames(self, frames: Sequence[Frame]) -> None:
        """Nobody watches."""

    @property
    def watch(self) -> WatchRequest | None:
        """Nobody watches."""
        return None

    @property
    def stop_requested(self) -> bool:
        """Whether the step was reached."""
        return self._stop_at is not None and self._step >= self._stop_at


def training_of(algorithm: Mapping[str, Any], *, steps: int, **others: Any) -> TrainingConfig:
    """A training with an algorithm; `others` are more of its settings, such as `task`."""
    return TrainingConfig.model_validate({"algorithm": dict(algorithm), "steps": steps, **others}).as_installed()


def train(
    training: TrainingConfig, directory: Path, *, seed: int = 1, stop_at: int | None = None, resume: Path | None = None
) -> Path:
    """Train, and return the last checkpoint's archive.

    Args:
        training: what to train.
        directory: for the archives.
        seed: of the training.
        stop_at: step after which it is asked to stop.
        resume: an archive to go on from.
    """
    reports = _Reports(stop_at)
    run(training, seed, reports, directory, resume, report_interval=0.0)
    assert reports.archive is not None
    return reports.archive


def checkpoint_of(archive: Path) -> dict[str, NDArray[np.generic]]:
    """All arrays of a checkpoint: the policy's weights and the state to resume from."""
    checkpoint = read_checkpoint(archive)
    return {**checkpoint.weights, **checkpoint.arrays}
