"""Evaluations that people ask for, in JSON."""

from typing import Literal, Self

from pydantic import Field, model_validator

from server.database.tables import JobState
from server.jobs.schemas import WAITS_FOR
from server.schemas import Estimate, Page, Schema
from sim.config import ArenaFile
from sim.extending.discovery import UsedExtension
from workers.job_protocol import OWN_SUITE, AnyPolicy, SuiteChoice
from workers.reporting import EpisodeResult, Outcome

MAX_AT_ONCE = 100
"""Evaluations that one request may ask for."""

MAX_BEHIND = 20
"""Of the evaluations before one that waits, so many are named."""


class TrainingPolicies(Schema):
    """The best checkpoint of each run of a training."""

    source: Literal["training"]
    id: str = Field(min_length=1, max_length=64)


class EvaluationRequest(Schema):
    """Which policies are to be measured, each on every one of the suites."""

    policies: list[AnyPolicy | TrainingPolicies] = Field(min_length=1, max_length=MAX_AT_ONCE)
    suites: list[SuiteChoice] = Field([OWN_SUITE], min_length=1, max_length=MAX_AT_ONCE)

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if (wanted := len(self.policies) * len(self.suites)) > MAX_AT_ONCE:
            raise ValueError(
                f"{len(self.policies)} policies on {len(self.suites)} suites are {wanted} evaluations: "
                f"ask for at most {MAX_AT_ONCE} at once"
            )
        return self


class TermReturn(Schema):
    """What a term of the reward comes to."""

    name: str = Field(description="As curves and settings have it.")
    value: float = Field(description="Mean of the episodes' sums.")


class EvaluationFigures(Schema):
    """How a policy did; rates are shares of the episodes, 0 to 1."""

    episodes: int
    success: Estimate
    collision: float
    timeout: float
    spl: float = Field(description="Success weighted by path length (Anderson et al. 2018).")
    worst_tenth_spl: float = Field(description="The same over the tenth of the episodes that did worst.")
    steps: float | None = Field(description="Control steps of the episodes that arrived; null where none did.")
    seconds: float | None = Field(description="Of simulated time, of the episodes that arrived; null where none did.")
    path_length: float | None = Field(description="Metres, of the episodes that arrived; null where none did.")
    min_clearance: float = Field(description="Mean of the episodes' smallest distance to anything else, metres.")
    jerk: float = Field(description="Mean size of the jerk along the heading, m/s3.")
    reward: float = Field(description="By the policy's own reward, mean of the episodes' sums.")
    terms: list[TermReturn] | None = Field(
        None, description="The same by the reward's terms, in its order; null where it was measured before these were kept."
    )


class AskedEvaluation(Schema):
    """A policy or a baseline on a suite."""

    id: str
    title: str = Field(description="Of the policy.")
    policy: AnyPolicy
    choice: SuiteChoice
    run_id: str | None = Field(description="Of its policy, where that is a run's and is still there.")
    created_at: float
    job_id: str
    state: JobState
    progress: float = Field(description="Share of the work that is done, 0 to 1.")
    seconds_left: float | None = Field(description="Null where that is not known yet, and once it has ended.")
    error: str | None
    waits_for: list[UsedExtension] = Field(description=WAITS_FOR)
    behind: list[str] = Field([], description="While it waits: evaluations under way, then those that go before it.")
    starts_in: float | None = Field(None, description="Seconds, about; null where others go first, or it is not known yet.")
    suite: str | None = Field(description="Its name; null until it is measured.")
    suite_hash: str | None
    figures: EvaluationFigures | None = Field(description="Null until it is measured.")


class AskedEvaluationPage(Page[AskedEvaluation]):
    """Some of the evaluations, the newest first."""


class AskedEpisodes(Schema):
    """Every episode behind an evaluation's figures."""

    suite: str | None
    suite_hash: str | None
    episodes: tuple[EpisodeResult, ...]
    maps: tuple[str, ...] = Field((), description="The arena of each, by name; empty where they took too much room to keep.")
    spl: tuple[float, ...] = Field((), description="Of each: shortest path over the driven one, 0 where it did not arrive.")


class ExportedEpisode(Schema):
    """An episode as it leaves; what was not kept is null."""

    scenario: int = Field(description="Its place in the suite, from 1, as pages count.")
    map: str | None
    outcome: Outcome
    steps: int
    seconds: float
    path_length: float
    shortest_path: float
    spl: float = Field(description="Shortest path over the driven one, 0 where it did not arrive.")
    clearance: float
    jerk: float | None
    reward: float = Field(description="Its sum: the return.")
    terms: dict[str, float] | None = Field(description="The return by the reward's terms.")


class ExportedEvaluation(Schema):
    """An evaluation as it leaves."""

    id: str
    title: str
    suite: str
    suite_hash: str
    figures: EvaluationFigures
    episodes: list[ExportedEpisode]


class Way(Schema):
    """Where a robot drove in one of the episodes."""

    episode: int = Field(description="Its place in the suite, from 0.")
    outcome: Outcome
    target: tuple[float, float] = Field(description="x and y, metres.")
    points: tuple[tuple[float, float], ...] = Field(description="x and y from its start to its end, metres.")


class PlaceSuccess(Schema):
    """How many of the episodes in one of the suite's arenas arrived."""

    arena: int = Field(description="Its place among the suite's arenas, from 0.")
    name: str
    episodes: int
    arrivals: int


class EvaluationWays(Schema):
    """Where the robots drove in one of the suite's arenas."""

    places: list[PlaceSuccess] = Field(description="All arenas of the suite, the worst first.")
    arena: int = Field(description="The one that is drawn here.")
    geometry: ArenaFile
    ways: list[Way]
