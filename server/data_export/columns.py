"""The columns of what leaves as a table, as CSV or as Parquet: their names, what is in them and in which unit."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Kind = Literal["text", "integer", "number", "single", "flag"]
"""Text that repeats itself, int64, float64, float32, true or false."""


@dataclass(frozen=True, slots=True)
class Column:
    """One of a table.

    Attributes:
        name: in the heading.
        kind: of its cells.
        meaning: in a few words.
        unit: of a number; None where it counts, or is of what the metric is of.
    """

    name: str
    kind: Kind
    meaning: str
    unit: str | None = None


_STEP = Column("step", "integer", "environment steps of the run", "step")
_METRIC = Column("metric", "text", "name of the metric")
_SEED = Column("seed", "integer", "of the run")

POINTS = (
    Column("run", "text", "id of the run"),
    _SEED,
    _METRIC,
    _STEP,
    Column("wall_time", "number", "when it was reported, since the epoch (UTC)", "s"),
    Column("value", "single", "as it is stored; missing where it was not finite"),
)
BUCKETS = (
    Column("points", "integer", "that the row stands for: 1, or so many of which the value is the mean"),
    Column("min", "single", "the smallest of them"),
    Column("max", "single", "the largest of them"),
)
"""Beside `POINTS` where curves were thinned."""

_EXPERIMENT = (Column("experiment", "text", "its id"), Column("name", "text", "its name"))
_LOW = Column("low", "number", "lower end of the 95 % interval")
_HIGH = Column("high", "number", "upper end of the 95 % interval")
FIGURES = (
    *_EXPERIMENT,
    Column("figure", "text", "success (0 to 1), steps_per_target (control steps), reward (of an episode)"),
    Column("value", "number", "of the figure"),
    _LOW,
    _HIGH,
    Column("seeds", "integer", "runs that it is measured over"),
    Column("episodes", "integer", "of all these runs together"),
    Column("suite", "text", "that was driven"),
    Column("suite_hash", "text", "only figures of the same hash may be compared"),
)
MEANS = (
    *_EXPERIMENT,
    _METRIC,
    _STEP,
    Column("mean", "number", "over seeds"),
    _LOW,
    _HIGH,
    Column("seeds", "integer", "that have a value"),
)
SEEDS = (*_EXPERIMENT, _SEED, _METRIC, _STEP, Column("value", "number", "of the run, between its own points"))
THINNED = Column("thinned", "flag", "whether the run's points are means of neighbouring ones")


def heading(columns: Sequence[Column]) -> tuple[str, ...]:
    """The names, in their order."""
    return tuple(column.name for column in columns)
