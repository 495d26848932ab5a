"""Experiments side by side in JSON."""

from typing import Any, Literal

from pydantic import Field

from server.comparison.grid import Across, Spacing
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


class PairedTest(Schema):
    """Two experiments' policies on the same scenarios: speaks of these policies, not of further seeds."""

    test: Literal["randomisation", "signed rank"] = Field(
        description="Exact paired randomisation test of the share of seeds that arrived (with one seed each McNemar's), or "
        "Wilcoxon's signed-rank test of the seeds' mean steps."
    )
    scenarios: int = Field(description="In which both have something to show.")
    better: int = Field(description="Scenarios in which the other one is better than the base.")
    worse: int
    p: float = Field(description="Two-sided, over scenarios; 1e-9 stands for anything less.")
    p_holm: float = Field(description="The same after as many paired tests as there are here (Holm 1979).")


class ComparisonVerdict(Schema):
    """What may be said of an experiment beside another one, the base, in one measure."""

    measure: Measure
    base: str = Field(description="Id of the experiment that it is held against.")
    other: str = Field(description="Id of the one that is judged.")
    word: ComparisonWord = Field(
        description="Of the other: direction by the 95 % interval, equivalence by two one-sided tests at 5 %, or neither; "
        "refused below five seeds or over different suites."
    )
    difference: float | None = Field(description="Other less base, of their means over seeds; null where refused.")
    low: float | None = Field(description="Lower end of its 95 % interval.")
    high: float | None = Field(description="Upper end of its 95 % interval.")
    margin: float = Field(description="Differences up to this do not matter.")
    p: float | None = Field(
        description="Two-sided, over seeds: at the confidence 1 - p the interval just touches zero; 1e-9 stands for what is "
        "less. Null where refused."
    )
    p_holm: float | None = Field(description="The same after as many comparisons as there are here (Holm 1979).")
    paired: PairedTest | None = Field(description="Null where refused, or where there is no scenario to pair.")
    reason: str = Field(description="As a sentence, with figures.")


class Improvement(Schema):
    """How likely a seed of one experiment scores higher than a seed of another in a scenario (Agarwal et al. 2021).

    The score is that of the SPL: path efficiency of an arrival, else 0. Equal scores count half.
    """

    base: str
    other: str
    value: float = Field(description="That the other one improves on the base, 0 to 1; 0.5 where they are alike.")
    low: float = Field(description="Lower end of the 95 % interval over seeds.")
    high: float = Field(description="Upper end.")


class Comparison(Schema):
    """Experiments side by side, in the order asked for."""

    experiments: list[ComparedExperiment]
    base: str | None = Field(description="Id of the one that the others are held against; null for every pair.")
    verdicts: list[ComparisonVerdict] = Field(description="Every experiment against the base, or every pair.")
    comparisons: int = Field(description="Verdicts that were not refused: of so many at 95 %, about one in twenty misses.")
    improvements: list[Improvement] = Field(description="Of every pair with verdicts on one suite.")
    differences: list[Difference]
    warnings: list[str] = Field(description="What speaks against reading too much into the figures.")


class SeedCurve(Schema):
    """One run on the common grid; null before its first point and after its last."""

    seed: int
    values: list[float | None]
    thinned: bool = Field(False, description="Curves of this run were thinned: of neighbouring points their means are left.")


class ExperimentCurves(Schema):
    """An experiment's runs on the common grid, and what they are together.

    `mean` is told where every run that has got to the last step has a value: over time, from when the slowest began to when
    the quickest was done. `low` and `high` are its 95 % interval over seeds (Student's t, of rates on the scale of the
    logit); null where fewer than two have a value.
    """

    id: str
    name: str
    seeds: list[SeedCurve] = Field(description="Of the first ones, where no more lines were asked for.")
    mean: list[float | None]
    low: list[float | None]
    high: list[float | None]
    count: list[int] = Field(description="Seeds with a value.")
    unplaced: int = Field(
        0, description="Runs that have the metric and are left out: what the grid is of was not counted when they trained."
    )


class Curves(Schema):
    """One metric of several experiments on one grid.

    Each run is interpolated between its own points, and has no value before its first and after its last.
    """

    name: str
    across: Across = Field(
        "steps",
        description="What the grid is of: environment steps, seconds under way (without the time that a run waited, was "
        "stopped or lost), seconds of its trainer's CPU time, or episodes that have ended.",
    )
    spacing: Spacing = Field(
        "points",
        description="How the grid lies: on the points of all runs together or, where those are too many, evenly over their "
        "range, or by equal factors.",
    )
    steps: list[int] = Field(description="The grid; empty where it is not of steps.")
    x: list[float] | None = Field(None, description="The grid; null where it is of steps.")
    since: int | None = Field(
        None,
        description="The step beyond which this is all there is: what is known up to there stays. Null for a whole answer.",
    )
    follow: str | None = Field(
        None, description="Asked again with it as `since`, what is new comes alone; null where the next answer is whole."
    )
    experiments: list[ExperimentCurves]


class ReportedMetric(Schema):
    """A metric, and how many of the runs have reported it."""

    name: str
    runs: int


class ReportedMetrics(Schema):
    """What the runs of experiments have reported."""

    runs: int = Field(description="Of all these experiments.")
    metrics: list[ReportedMetric] = Field(description="By name; the first 500.")


class Profile(Schema):
    """Share of an experiment's attempts that score more than each threshold; `low` and `high` are null for one seed."""

    id: str
    name: str
    seeds: int
    mean: list[float | None]
    low: list[float | None]
    high: list[float | None]


class Profiles(Schema):
    """Performance profiles (Agarwal et al. 2021) of final evaluations.

    The score is that of the SPL: path efficiency of an arrival, else 0. At the threshold 0 stands the success rate.
    """

    thresholds: list[float]
    experiments: list[Profile] = Field(description="In the order asked for; empty lists before the first evaluation.")
