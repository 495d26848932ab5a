"""Evaluations that people ask for, in JSON."""

from pydantic import Field

from server.database.tables import JobState
from server.schemas import Estimate, Page, Schema
from workers.job_protocol import AnyPolicy, OwnSuite, SuiteChoice
from workers.reporting import EpisodeResult


class EvaluationRequest(Schema):
    """Which policy is to be measured on which suite."""

    policy: AnyPolicy
    suite: SuiteChoice = OwnSuite()


class EvaluationFigures(Schema):
    """How a policy did; rates are shares of the episodes, 0 to 1."""

    episodes: int
    success: Estimate
    collision: float
    timeout: float
    spl: float = Field(description="Success weighted by path length.")
    steps: float | None = Field(description="Control steps of the episodes that arrived; null where none did.")
    min_clearance: float = Field(description="Mean of the episodes' smallest distance to anything else, metres.")


class AskedEvaluation(Schema):
    """A policy or a baseline on a suite."""

    id: str
    title: str = Field(description="Of the policy.")
    policy: AnyPolicy
    choice: SuiteChoice
    created_at: float
    job_id: str
    state: JobState
    progress: float = Field(description="Share of the work that is done, 0 to 1.")
    seconds_left: float | None = Field(description="Null where that is not known yet, and once it has ended.")
    error: str | None
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
