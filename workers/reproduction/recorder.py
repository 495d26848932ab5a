"""What a training of a campaign reports, kept in a file beside its checkpoints: one JSON object a line."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from workers.frames import Frame
from workers.reporting import EvaluationResult, EventLevel, WatchRequest

METRICS = "metrics.jsonl"

_EVALUATION_SUCCESS = "eval/success_rate"


class Recorder:
    """A `Reporter` into a folder; only the last checkpoint is kept, from which to go on.

    Args:
        folder: of the training.
        resumed_at: step of the checkpoint that the training goes on from; what was recorded beyond it is dropped.
        told: of every step that metrics come with.
        stop_requested: asked between updates.
    """

    watch: WatchRequest | None = None

    def __init__(
        self, folder: Path, resumed_at: int, told: Callable[[int], None], stop_requested: Callable[[], bool]
    ) -> None:
        self._path = folder / METRICS
        self._told, self._stop_requested = told, stop_requested
        kept = [record for record in read_records(folder) if record["step"] <= resumed_at]
        self._path.write_text("".join(f"{json.dumps(record)}\n" for record in kept))

    @property
    def stop_requested(self) -> bool:
        """Whether the campaign is interrupted."""
        return self._stop_requested()

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """Appends a line; it is on disk before any checkpoint that comes after it."""
        with self._path.open("a") as file:
            file.write(f"{json.dumps({'step': step, **values})}\n")
        self._told(step)

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """Not kept."""

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """Drops those that came before."""
        for other in archive.parent.glob("step-*.zip"):
            if other != archive:
                other.unlink()

    def frames(self, frames: Sequence[Frame]) -> None:
        """Nobody watches."""


def read_records(folder: Path) -> list[dict[str, float]]:
    """The recorded lines in order; a last line that was torn by a crash is left out."""
    path = folder / METRICS
    records = []
    for line in path.read_text().splitlines() if path.exists() else []:
        try:
            records.append(json.loads(line))
        except json.JSONDecodeError:
            break
    return records


def series(records: Sequence[Mapping[str, float]], name: str) -> tuple[list[int], list[float]]:
    """One metric: its steps and values, where it has any."""
    points = [(int(record["step"]), record[name]) for record in records if name in record]
    return [step for step, _ in points], [value for _, value in points]


def evaluations(records: Sequence[Mapping[str, float]]) -> tuple[list[int], list[float]]:
    """Steps and success rates of the evaluations on the frozen suite."""
    return series(records, _EVALUATION_SUCCESS)
