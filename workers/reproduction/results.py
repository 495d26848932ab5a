"""What a campaign has measured, by row and seed (pydantic only)."""

from collections.abc import Mapping, Sequence

from sim.config import Frozen
from workers.reproduction.table import TableRow
from workers.statistics import mean_interval

LEARNED = 0.9
"""A training has learned its task once the frozen suite sees this success rate."""


class SeedResult(Frozen):
    """A row trained with one seed.

    Attributes:
        steps: environment steps that it was trained for.
        measured: by its drives.
        learned_at: environment steps at the first evaluation with `LEARNED` success or more; None where none had.
    """

    seed: int
    steps: int
    measured: TableRow
    learned_at: int | None


Results = Mapping[str, Sequence[SeedResult]]
"""Of the seeds that are done, by row."""


class Progress(Frozen):
    """How far a training is.

    Attributes:
        before: part of it that was done before this process took it up, 0 to 1.
        done: part that is done now.
        seconds: that this process has spent on it.
    """

    before: float
    done: float
    seconds: float


class Trained(Frozen):
    """A finished training.

    Attributes:
        result: what its row's statistics are made of.
        curve_steps: environment steps of its learning curve.
        curve: the curve.
    """

    result: SeedResult
    curve_steps: tuple[int, ...]
    curve: tuple[float, ...]


class Spread(Frozen):
    """A mean over seeds with its 95 % interval; `low` and `high` are None with one seed."""

    mean: float
    low: float | None
    high: float | None


def learned_at(steps: Sequence[int], success: Sequence[float]) -> int | None:
    """The step of the first evaluation with `LEARNED` success or more.

    Args:
        steps: of the evaluations, ascending.
        success: of each, 0 to 1.
    """
    return next((step for step, rate in zip(steps, success, strict=True) if rate >= LEARNED), None)


def spread(values: Sequence[float], least: float = 0.0, most: float = float("inf")) -> Spread:
    """The mean of at least one seed; the interval is cut to the range that such a number can have."""
    mean, low, high = mean_interval(values)
    if len(values) < 2:
        return Spread(mean=mean, low=None, high=None)
    return Spread(mean=mean, low=max(least, low), high=min(most, high))


class RowSpread(Frozen):
    """A table's line over seeds."""

    reward: Spread
    episodes: Spread
    success: Spread
    collisions: Spread
    steps: Spread


def row_spread(seeds: Sequence[SeedResult]) -> RowSpread | None:
    """All figures of a row; None before the first seed is done."""
    if not seeds:
        return None
    rows = [seed.measured for seed in seeds]
    return RowSpread(
        reward=spread([row.reward or 0.0 for row in rows], least=float("-inf")),
        episodes=spread([row.episodes for row in rows]),
        success=spread([row.success for row in rows], most=1.0),
        collisions=spread([row.collisions or 0.0 for row in rows], most=1.0),
        steps=spread([row.steps for row in rows]),
    )
