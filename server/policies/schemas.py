"""Shipped policies in JSON."""

from pydantic import Field

from server.schemas import Estimate, Schema
from workers.config import TrainingConfig
from workers.reporting import EpisodeResult


class SuiteRow(Schema):
    """A policy or a baseline on a suite; rates are shares of the episodes."""

    name: str = Field(description="Of the policy or the baseline.")
    success: Estimate
    collision: float
    timeout: float
    spl: float = Field(description="Success weighted by path length (Anderson et al. 2018).")
    steps: float | None = Field(description="Control steps to the target, over the episodes that arrived.")


class SuiteResult(Schema):
    """A policy on a suite, beside what needs no training."""

    suite: str
    suite_hash: str = Field(description="Only results of the same hash may be compared.")
    policy: SuiteRow
    baselines: list[SuiteRow]


class ShippedPolicy(Schema):
    """A trained policy that ships with the project."""

    name: str = Field(description="In addresses and on the command line.")
    title: str
    description: str
    command: str = Field(description="What made it.")
    training: TrainingConfig
    seed: int
    step: int = Field(description="Environment steps after which it was kept: the best on the first of its suites.")
    size: int = Field(description="Bytes of its archive.")
    results: list[SuiteResult]


class PolicyEpisodes(Schema):
    """Every episode of a shipped policy on a suite, in the suite's order."""

    suite: str
    suite_hash: str
    episodes: tuple[EpisodeResult, ...]
