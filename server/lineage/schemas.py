"""Where trainings begin, in JSON."""

from typing import Literal

from pydantic import Field

from server.schemas import Estimate, Schema
from workers.start import StartFrom


class StartPolicy(Schema):
    """A policy that a training may begin with."""

    start_from: StartFrom
    kind: Literal["best", "last", "other", "shipped"] = Field(
        description="Which of its run's checkpoints, or one that ships."
    )
    experiment_id: str | None = Field(description="Of the training that made it; null for one that ships.")
    success: Estimate | None = Field(description="Of its own evaluation; null where there is none.")


class Parent(Schema):
    """What a training began with."""

    start_from: StartFrom
    state: Literal["there", "gone", "hidden"] = Field(
        description="Hidden in a project that one may not see; gone where it was deleted since."
    )
    run_id: str | None = Field(description="Whose checkpoint it is; null unless it is there and no policy that ships.")
    step: int | None = Field(description="Of that checkpoint.")


class Child(Schema):
    """A training that began with a checkpoint of this one."""

    id: str
    name: str
    seed: int = Field(description="Of the run that it began with.")
    step: int = Field(description="Of the checkpoint.")


class Lineage(Schema):
    """Where a training comes from, and what came of it."""

    parent: Parent | None = Field(description="Null where it began with fresh weights.")
    children: list[Child] = Field(description="Those that one may see, the newest first.")
