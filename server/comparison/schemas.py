"""Experiments side by side in JSON."""

from typing import Any, Literal

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
    left_out: list[bool] = Field(
        description="Likewise: whether it is of something in a list, a part of an observation say, that is left out there."
    )


Measure = Literal["success", "steps_per_target"]
ComparisonWord = Literal["better", "worse", "equivalent", "not told", "refused"]


class ComparisonVerdict(Schema):
    """What may be said of an experiment beside the first one, in one measure."""

    measure: Measure
    base: str = Field(description="Id of the first experiment.")
    other: str = Field(description="Id of the one that is judged.")
    word: ComparisonWord = Field(
        description="Of the other: direction by the 95 % interval, equivalence by two one-sided tests at 5 %, or neither; "
        "refused below five seeds or over different suites."
    )
    difference: float | None = Field(description="Other less base, of their means over seeds; null where refused.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")
    margin: float = Field(description="Differences up to this do not matter.")
    reason: str = Field(description="As a sentence, with figures.")


class Comparison(Schema):
    """Experiments side by side, in the order asked for."""

    experiments: list[ComparedExperiment]
    verdicts: list[ComparisonVerdict] = Field(description="Every experiment against the first.")
    differences: list[Difference]
    warnings: list[str] = Field(description="What speaks against reading too much into the figures.")


class SeedCurve(Schema):
    """One run on the common grid; null before its first point and after its last."""

    seed: int
    values: list[float | None]


class ExperimentCurves(Schema):
    """An experiment's runs on the common grid, and what they are together.

    `low` and `high` are the 95 % interval of `mean` over seeds (Student's t, of rates on the scale of the logit); null where
    fewer than two have a value.
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
