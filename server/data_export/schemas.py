"""What leaves as JSON. Times are seconds since the epoch."""

from typing import Any

from pydantic import Field

from server.comparison.schemas import Comparison, Curves
from server.database.tables import RunState
from server.metrics.schemas import Thinned
from server.schemas import Schema
from workers.reporting import EpisodeResult


class ExportedEvaluation(Schema):
    """What a checkpoint achieved on a suite."""

    checkpoint: str = Field(description="Its id.")
    step: int
    suite: str
    suite_hash: str
    episodes: list[EpisodeResult] = Field(description="In the suite's order.")


class ExportedRun(Schema):
    """One seed's training."""

    id: str
    seed: int
    state: RunState
    attempt: int
    step: int
    worker: str | None
    error: str | None
    created_at: float
    started_at: float | None
    finished_at: float | None
    thinned: Thinned | None = Field(None, description="What was done to its curves; null where every point is kept.")
    final_evaluation: ExportedEvaluation | None = Field(description="Of its last evaluated checkpoint.")


class ExportedExperiment(Schema):
    """A configuration and the runs of it that are exported, one or all."""

    id: str
    name: str
    project_id: str
    created_at: float
    notes: str | None
    training: dict[str, Any] = Field(description="The configuration as it is stored.")
    runs: list[ExportedRun]


class ExportedComparison(Schema):
    """Experiments side by side, with the curves of one metric."""

    comparison: Comparison
    curves: Curves
