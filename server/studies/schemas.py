"""Studies in JSON: what is sent to launch one, and what is read back."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from server.database.tables import DEFAULT_PROJECT, StudyState, TrialState
from server.experiments.schemas import ExperimentName, ExperimentState, Seed
from server.schemas import Estimate, Page, Schema
from server.studies.proposals import SamplerName
from server.studies.space import MAX_SETTINGS, SearchedSetting, Values
from workers.config import TrainingConfig

MAX_TRIALS = 500
JUDGES = 5
"""Fresh seeds on which the best trial is judged."""

Trials = Annotated[int, Field(ge=1, le=MAX_TRIALS, description="That it may have.")]


class StudySpec(Schema):
    """What is searched, and how."""

    training: TrainingConfig = Field(description="Whose other settings all trials share.")
    settings: list[SearchedSetting] = Field(min_length=1, max_length=MAX_SETTINGS)
    sampler: SamplerName = Field(
        "tpe",
        description="tpe goes on where trials did well (Bergstra et al. 2011); random, and quasi, which fills the space "
        "evenly, look at no results; grid takes each combination once.",
    )
    seeds: list[Seed] = Field(
        [0, 1, 2],
        min_length=3,
        max_length=20,
        description=f"Of every trial, which count by their interquartile mean; the best is judged on {JUDGES} others.",
    )
    at_once: int = Field(2, ge=1, le=20, description="Trials that go on at the same time.")
    stop_early: bool = Field(True, description="Whether trials that do worse than the median are stopped on their way.")
    seed: Seed = Field(0, description="Of the sampler: the same trials with the same results lead to the same next one.")

    @model_validator(mode="after")
    def _seeds_differ(self) -> Self:
        if len(set(self.seeds)) < len(self.seeds):
            raise ValueError("every seed may be there only once")
        return self


class StudyLaunch(StudySpec):
    """A study, and where it belongs."""

    name: ExperimentName
    project_id: str = Field(DEFAULT_PROJECT, max_length=16, description="Of the project that it is launched into.")
    trials: Trials = 30


class StudyExtension(Schema):
    """More trials for a study."""

    trials: int = Field(ge=1, le=MAX_TRIALS, description="To add.")


class Trial(Schema):
    """One choice of the settings, trained with every tuning seed."""

    number: int = Field(description="From 1, in the order of their launch.")
    state: TrialState = Field(description="pruned: stopped early; stopped: with the study, and resumed with it.")
    values: Values
    experiment_id: str | None = Field(description="Its training; null where the settings make none, or it was deleted.")
    progress: float = Field(description="Steps done by its runs over those that they were given, 0 to 1.")
    success: float | None = Field(description="Interquartile mean over the seeds, 0 to 1; null unless it is complete.")
    seconds_to_target: float | None = Field(description="Of simulated time, likewise, of what arrived; null where none did.")
    cost: float | None = Field(description="Seconds that its runs were trained for, together; null while it goes on.")
    rungs: dict[int, float] = Field(description="Success on the way over the seeds that had got there, by steps.")
    reason: str | None = Field(description="Why it was stopped early or failed; null otherwise.")


class Judgement(Schema):
    """The best trial's settings, trained with seeds that the search never saw."""

    trial: int = Field(description="Whose settings were judged.")
    experiment_id: str
    seeds: list[int]
    state: ExperimentState
    success: Estimate | None = Field(description="Null before the first evaluation.")


class ListedStudy(Schema):
    """A study as a list shows it."""

    id: str
    project_id: str
    name: str
    created_at: float
    finished_at: float | None
    state: StudyState = Field(description="judging: all trials are through, and the best is trained with fresh seeds.")
    sampler: SamplerName
    trials: int = Field(description="That it may have.")
    asked: int = Field(description="That it has had, with those that go on.")
    complete: int
    pruned: int = Field(description="Trials that were stopped early.")
    failed: int
    best_success: float | None = Field(description="Of the best trial, by its tuning seeds; null before one is complete.")


class Span(Schema):
    """From where to where."""

    low: float
    high: float


class ImportanceIntervals(Schema):
    """How sure the importances are: what they might have been, had other trials been drawn."""

    unit: Literal["trials"] = Field("trials", description="What was resampled.")
    trials: int = Field(description="Complete ones, of which each resample draws as many.")
    resamples: int = Field(description="By whose importances the ends of the intervals are.")
    spans: dict[str, Span] = Field(description="Of each setting 95 %, 0 to 1; empty where they can't be told.")
    told: str = Field(description="What they are over, or why there are none.")


class Study(ListedStudy):
    """A study with its trials."""

    spec: StudySpec
    rule: str | None = Field(description="By which trials are stopped early; null where none are.")
    progress: float = Field(description="Share of the trials that is through, those that go on by their steps; 0 to 1.")
    seconds_left: float | None = Field(description="Until the last trial is through; null where that is not known.")
    results: list[Trial] = Field(description="By number.")
    best: int | None = Field(description="Number of the best trial: success, then time to target.")
    front: list[int] = Field(description="Complete trials that no other one beats in both cost and success, by cost.")
    importances: dict[str, float] | None = Field(
        description="How much each setting had to do with being among the best (PED-ANOVA), together 1; null before "
        "that can be said."
    )
    importance_intervals: ImportanceIntervals | None = Field(description="Null where importances are.")
    judgement: Judgement | None = Field(description="Null before all trials are through.")


class StudyPage(Page[ListedStudy]):
    """Some of the studies, the newest first."""
