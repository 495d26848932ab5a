"""An experiment in JSON: what is sent to launch one, and what is read back."""

from typing import Annotated, Any, Literal

from pydantic import Field, StringConstraints, field_validator

from server.database.tables import RunState
from server.runs.schemas import Run
from server.schemas import UNREADABLE, Estimate, Line, Schema
from sim.config import Frozen
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


class ExperimentPatch(Schema):
    """What may be changed after launch."""

    name: ExperimentName


class Experiment(Schema):
    """One configuration x several seeds."""

    id: str
    name: str
    created_at: float
    training: TrainingConfig
    unreadable: list[str] = Field(description=UNREADABLE)
    state: ExperimentState = Field(description="Of its runs together; mixed where they ended differently.")
    runs: list[Run] = Field(description="One a seed, by seed.")
    campaign: str | None = Field(description="Of the paper's reproduction that it was launched by; null for all others.")
    success: Estimate | None = Field(
        description="Success rate of its runs' last evaluated checkpoints; null before the first evaluation."
    )


class ListedExperiment(Schema):
    """An experiment as a list shows it: without its whole configuration and its runs."""

    id: str
    name: str
    created_at: float
    arena: str
    movers: int = Field(description="Moving obstacles.")
    robot: str
    algorithm: str
    network: str
    reward: str
    unreadable: list[str] = Field(description=UNREADABLE)
    state: ExperimentState = Field(description="Of its runs together; mixed where they ended differently.")
    states: list[RunState] = Field(description="That its runs are in, each once.")
    runs: int
    progress: float = Field(description="Steps done by all runs over the steps that they were given, 0 to 1.")
    seconds_left: float | None = Field(
        description="Until its last run is through, those that wait included; null where that is not known."
    )
    campaign: str | None = Field(description="Of the paper's reproduction that it was launched by; null for all others.")
    success: Estimate | None = Field(
        description="Success rate of its runs' last evaluated checkpoints; null before the first evaluation."
    )


class TrainingForm(Schema):
    """Everything that the launch form is made of."""

    form_schema: dict[str, Any] = Field(alias="schema", description="JSON schema of ExperimentCreate.")
    defaults: ExperimentCreate
    presets: list[Preset]
