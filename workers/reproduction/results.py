"""What a campaign has measured, by row and seed (pydantic only)."""

from collections.abc import Mapping, Sequence

from sim.config import Frozen
from workers.reproduction.rows import DRIVES
from workers.statistics.intervals import Interval
from workers.statistics.seeds import FailedSeeds, failed_seeds, mean_interval, success_rate
from workers.training.table import TableRow

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

    @property
    def attempts(self) -> float:
        """Target attempts of all its drives together."""
        return self.measured.episodes * DRIVES


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


def spread(values: Sequence[float], least: float = 0.0) -> Spread:
    """The mean of at least one seed with Student's t; the interval is cut where such a number begins."""
    return _spread(mean_interval(values), len(values), least)


def rate_spread(rates: Sequence[float], attempts: Sequence[float]) -> Spread:
    """The mean rate of at least one seed, with the interval of success rates."""
    return _spread(success_rate([rate * n for rate, n in zip(rates, attempts, strict=True)], attempts), len(rates), 0.0)


def _spread(interval: Interval, seeds: int, least: float) -> Spread:
    if seeds < 2:
        return Spread(mean=interval.value, low=None, high=None)
    return Spread(mean=interval.value, low=max(least, interval.low), high=interval.high)


class RowSpread(Frozen):
    """A table's line over seeds."""

    reward: Spread
    episodes: Spread
    success: Spread
    collisions: Spread
    steps: Spread
    failed: FailedSeeds


def row_spread(seeds: Sequence[SeedResult]) -> RowSpread | None:
    """All figures of a row; None before the first seed is done."""
    if not seeds:
        return None
    rows, attempts = [seed.measured for seed in seeds], [seed.attempts for seed in seeds]
    return RowSpread(
        reward=spread([row.reward or 0.0 for row in rows], least=float("-inf")),
        episodes=spread([row.episodes for row in rows]),
        success=rate_spread([row.success for row in rows], attempts),
        collisions=rate_spread([row.collisions or 0.0 for row in rows], attempts),
        steps=spread([row.steps for row in rows]),
        failed=failed_seeds([row.success for row in rows]),
    )
