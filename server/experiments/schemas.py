"""An experiment in JSON: what is sent to launch one, and what is read back."""

from typing import Annotated, Any, Literal

from pydantic import Field, StringConstraints, field_validator

from server.database.tables import DEFAULT_PROJECT, RunState
from server.runs.schemas import Run
from server.schemas import LACKING, UNREADABLE, Estimate, Line, Schema
from sim.config import Frozen
from sim.extending.discovery import UsedExtension
from workers.config import TrainingConfig
from workers.presets import Preset

ExperimentState = RunState | Literal["mixed"]

_MAX_SEEDS = 50
_MAX_SEED = 2**31 - 1

ExperimentName = Annotated[Line, StringConstraints(max_length=120)]
Seed = Annotated[int, Field(ge=0, le=_MAX_SEED)]


class ExperimentCreate(Frozen):
    """One configuration, to be trained once with each seed."""

    name: ExperimentName = Field("My first policy", title="Name", description="What you will know it by.")
    seeds: tuple[Seed, ...] = Field(
        (0,),
        min_length=1,
        max_length=_MAX_SEEDS,
        title="Seeds",
        description="One run each. One is enough to get a policy; five or more to claim anything about the configuration.",
    )
    training: TrainingConfig = Field(default_factory=TrainingConfig, title="Training")

    @field_validator("seeds")
    @classmethod
    def _seeds_differ(cls, seeds: tuple[int, ...]) -> tuple[int, ...]:
        if len(set(seeds)) < len(seeds):
            raise ValueError("every seed may be there only once: two runs with the same seed are the same run")
        return seeds


class ExperimentLaunch(ExperimentCreate):
    """An experiment, and where it belongs."""

    project_id: str = Field(DEFAULT_PROJECT, max_length=16, description="Of the project that it is launched into.")
    parallel_runs: int | None = Field(
        None, ge=1, le=_MAX_SEEDS, description="Of its runs that may be under way at a time; null: as the installation says."
    )


class ExperimentPatch(Schema):
    """What may be changed after launch; what is absent stays as it is."""

    name: ExperimentName | None = None
    project_id: str | None = Field(None, max_length=16, description="Of the project that it is moved to.")
    parallel_runs: int | None = Field(
        None, ge=0, le=_MAX_SEEDS, description="Of its runs that may be under way at a time; 0: as the installation says."
    )


class Experiment(Schema):
    """One configuration x several seeds."""

    id: str
    project_id: str
    name: str
    created_at: float
    training: TrainingConfig
    unreadable: list[str] = Field(description=UNREADABLE)
    lacking: list[UsedExtension] = Field(description=LACKING)
    state: ExperimentState = Field(description="Of its runs together; mixed where they ended differently.")
    runs: list[Run] = Field(description="One a seed, by seed.")
    parallel_runs: int | None = Field(
        description="Of its runs that may be under way at a time; null: as the installation says."
    )
    campaign: str | None = Field(description="Of the paper's reproduction that it was launched by; null for all others.")
    study_id: str | None = Field(description="Of the study that it is a trial of; null for all others.")
    success: Estimate | None = Field(
        description="Success rate of its runs' last evaluated checkpoints; null before the first evaluation."
    )


class TrainingPace(Schema):
    """How quick runs like one that is about to be launched were here."""

    steps_per_second: float | None = Field(description="Median of those that ended last; null where there is none like it.")
    runs: int = Field(description="Behind the median.")


class TrainingForm(Schema):
    """Everything that the launch form is made of."""

    form_schema: dict[str, Any] = Field(alias="schema", description="JSON schema of ExperimentCreate.")
    defaults: ExperimentCreate
    presets: list[Preset]
