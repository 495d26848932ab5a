"""How quickly the training loop goes, for the benchmarks of it."""

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from workers.frames import Frame
from workers.reporting import EvaluationResult, EventLevel, WatchRequest
from workers.training.trainer import REPORT_INTERVAL, Training

NEVER = 10**9
"""Steps that no benchmark reaches."""


class Silent:
    """A reporter that nobody listens to."""

    watch: WatchRequest | None = None
    stop_requested = False

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """Heard by nobody."""

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """Heard by nobody."""

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """Heard by nobody."""

    def frames(self, frames: Sequence[Frame]) -> None:
        """Heard by nobody."""


def ours(training: Training, steps: int) -> float:
    """Steps per CPU-second over a number of steps of the training loop, reports included."""
    started, first = time.process_time(), training.step
    while training.step - first < steps:
        training.collect()
        training.update()
        if training.metrics.seconds >= REPORT_INTERVAL:
            training.report(None)
    return (training.step - first) / (time.process_time() - started)
