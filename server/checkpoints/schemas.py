"""Checkpoints and their evaluations in JSON."""

from pydantic import Field

from server.schemas import Estimate, Page, Schema
from workers.reporting import EpisodeResult


class Evaluation(Schema):
    """A checkpoint on a suite."""

    suite: str
    suite_hash: str = Field(description="Only evaluations of the same hash may be compared.")
    episodes: int
    arrivals: int
    success: Estimate = Field(description="Arrivals over episodes of this one policy, with the exact interval.")
    steps_mean: float | None = Field(description="Control steps to the target, over the episodes that arrived.")
    reward_mean: float = Field(description="Summed reward of an episode.")


class Checkpoint(Schema):
    """A policy at a step of a run."""

    id: str
    step: int
    size: int = Field(description="Bytes of the archive.")
    sha256: str
    created_at: float
    damaged: bool = Field(description="Its archive was found damaged or gone: the run went on from an older one.")
    goes_at: float | None = Field(description="When it goes because a rule took it, unless it is kept till then; else null.")
    best: bool = Field(description="Highest success rate of the run; of equal ones, fewest steps to the target.")
    evaluation: Evaluation | None


class CheckpointPage(Page[Checkpoint]):
    """Some of a run's checkpoints, the newest first."""

    best: Checkpoint | None = Field(description="The best of all of them; null before the first evaluation.")


class CheckpointStep(Schema):
    """A checkpoint on the way of its run."""

    id: str
    step: int
    success: float | None = Field(description="Share of its evaluation's episodes that arrived; null where it has none.")


class CheckpointSteps(Schema):
    """The way of a run by its checkpoints, the oldest first."""

    items: list[CheckpointStep] = Field(description="Of many, some evenly apart, the first and the last among them.")
    total: int


class Episodes(Schema):
    """Every episode of a checkpoint's evaluation, in the suite's order."""

    checkpoint_id: str
    suite: str
    suite_hash: str
    episodes: tuple[EpisodeResult, ...]
