"""A run in JSON. Times are seconds since the epoch, rates 0 to 1."""

from pydantic import Field

from server.database.tables import RunState
from server.metrics.schemas import Thinned
from server.schemas import LACKING, UNREADABLE, Schema
from sim.extending.discovery import UsedExtension
from workers.config import TrainingConfig
from workers.reporting import EventLevel


class Run(Schema):
    """One seed's training."""

    id: str
    experiment_id: str
    seed: int
    state: RunState
    attempt: int = Field(description="How often a worker has taken it up; 0 before the first.")
    step: int = Field(description="Environment steps done.")
    total_steps: int
    steps_per_second: float | None = Field(description="Null unless running.")
    seconds_left: float | None = Field(description="Null unless running.")
    success_rate: float | None = Field(description="Newest value of train/success_rate.")
    eval_success_rate: float | None = Field(description="Newest value of eval/success_rate.")
    worker: str | None = Field(description="The worker that has it, or had it last.")
    error: str | None = Field(description="Why it failed; null unless it did.")
    created_at: float
    started_at: float | None
    finished_at: float | None
    thins_at: float | None = Field(None, description="When its curves are thinned by a rule; null where none says so.")
    thinned: Thinned | None = Field(None, description="What was done to its curves; null where every point is kept.")


class RunDetail(Run):
    """A run with what it trains."""

    experiment_name: str
    training: TrainingConfig
    unreadable: list[str] = Field(description=UNREADABLE)
    lacking: list[UsedExtension] = Field(description=LACKING)
    waits_for: list[UsedExtension] = Field(
        description="Extensions that it needs, while it is queued and no worker that is there has them all."
    )


class RunEvent(Schema):
    """One line of a run's event log."""

    id: int
    at: float
    step: int
    level: EventLevel
    message: str
