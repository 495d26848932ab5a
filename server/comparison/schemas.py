"""Experiments side by side in JSON."""

from typing import Any

from pydantic import Field

from server.schemas import Estimate, Schema


class ComparedExperiment(Schema):
    """An experiment's final figures: of the last evaluated checkpoint of each of its runs, all on one suite."""

    id: str
    name: str
    seeds: int = Field(description="Runs with an evaluation on the suite.")
    episodes: int
    suite: str | None
    suite_hash: str | None
    success: Estimate | None
    steps_per_target: Estimate | None = Field(description="Control steps, over the episodes that arrived.")
    reward: Estimate | None = Field(description="Summed reward of an episode.")


class Difference(Schema):
    """A setting in which the experiments differ."""

    path: str = Field(description="Dotted path in the training's configuration.")
    values: list[Any] = Field(description="One an experiment, in their order; null where it has no such setting.")


class Comparison(Schema):
    """Experiments side by side, in the order asked for."""

    experiments: list[ComparedExperiment]
    differences: list[Difference]
    warnings: list[str] = Field(description="What speaks against reading too much into the figures.")


class SeedCurve(Schema):
    """One run on the common grid; null before its first point and after its last."""

    seed: int
    values: list[float | None]


class ExperimentCurves(Schema):
    """An experiment's runs on the common grid, and what they are together.

    `low` and `high` are the 95 % bootstrap interval of `mean`, over seeds; null where fewer than two have a value.
    """

    id: str
    name: str
    seeds: list[SeedCurve]
    mean: list[float | None]
    low: list[float | None]
    high: list[float | None]
    count: list[int] = Field(description="Seeds with a value.")


class Curves(Schema):
    """One metric of several experiments on one grid of environment steps."""

    name: str
    steps: list[int]
    experiments: list[ExperimentCurves]
