"""Curves over steps, or over what a run counts beside them, and the grid on which several lie together.

A trainer reports what has led to a step (`workers.manifest.Effort`) as series like any other, and a series is known by its
buckets: so a curve over time costs one more summary, and not its points. No counter ever falls: the highest value of a
bucket is the one at its last step.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from server.metrics.buckets import Buckets
from workers.training.effort import CPU, EPISODES, WALL

Across = Literal["steps", "wall", "cpu", "episodes"]
"""What x is: environment steps, seconds under way, seconds of CPU time, episodes that have ended."""

Spacing = Literal["points", "even", "logarithmic"]
"""How a grid lies: on the points of all curves, or from the first to the last of them evenly, or by equal factors."""

COUNTED_BY: Mapping[Across, str] = {"wall": WALL, "cpu": CPU, "episodes": EPISODES}


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One run's.

    Attributes:
        x: (n,) float64, strictly increasing.
        y: (n,) float64; nan for what was not finite.
        last_step: of its last point; -1 without one.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    last_step: int

    @classmethod
    def over_steps(cls, points: Buckets) -> "Curve":
        """Of a series, by its own steps."""
        return cls(points.steps.astype(np.float64), points.mean, int(points.steps[-1]) if len(points) else -1)

    @classmethod
    def over(cls, points: Buckets, counter: Buckets) -> "Curve":
        """Of a series, by what was counted at its steps; linear between two reports, and nothing beyond the first and last.

        Of several points at one count, the newest stands.
        """
        known = np.isfinite(counter.high)
        if not known.any():
            return cls(np.zeros(0), np.zeros(0), -1)
        x = np.interp(points.steps, counter.steps[known], counter.high[known], left=np.nan, right=np.nan)
        placed = np.isfinite(x)
        steps, x, y = points.steps[placed], x[placed], points.mean[placed]
        newest = np.append(np.diff(x) > 0, True)[: x.size]
        return cls(x[newest], y[newest], int(steps[-1]) if steps.size else -1)


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Where curves are looked at together.

    Attributes:
        x: (n,) float64, strictly increasing.
        spacing: how they lie.
    """

    x: NDArray[np.float64]
    spacing: Spacing


def common_grid(curves: Sequence[Curve], limit: int, *, whole: bool, logarithmic: bool = False) -> Grid:
    """The x of all curves together or, where those are more than `limit`, as many over their range.

    Args:
        curves: what is to lie on it.
        limit: of its x, at least 2.
        whole: whether x counts something whole.
        logarithmic: whether it is for a logarithmic axis, which has no place for 0.
    """
    ordered = [curve.x[curve.x > 0] if logarithmic else curve.x for curve in curves]
    ordered = [x for x in ordered if x.size]
    if not ordered:
        return Grid(np.zeros(0), "points")
    # Where one curve alone has too many, the others need not be looked through.
    if max(x.size for x in ordered) <= limit:
        together = np.unique(np.concatenate(ordered))
        if together.size <= limit:
            return Grid(together, "points")
    first, last = min(x[0] for x in ordered), max(x[-1] for x in ordered)
    x = np.geomspace(first, last, limit) if logarithmic else np.linspace(first, last, limit)
    # Rounding moves no end.
    x[0], x[-1] = first, last
    return Grid(np.unique(x.round() if whole else x), "logarithmic" if logarithmic else "even")


def resample(curve: Curve, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The curve at `x`, linear in between; nan before its first finite point and after its last."""
    finite = np.isfinite(curve.y)
    if not finite.any():
        return np.full(x.size, np.nan)
    return np.interp(x, curve.x[finite], curve.y[finite], left=np.nan, right=np.nan)


def all_under_way(curves: Sequence[Curve], values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Where on a grid the mean of seeds means what it says: where every seed that has got to the last step has a value.

    Over steps they all end there. Over time one is done before the others, and a mean that went on without it would jump to
    the slow ones. A seed that was cut short, or is still on its way, has its share as far as it goes and ends nothing.

    Args:
        curves: of the seeds.
        values: (seeds, n), theirs on the grid.
    """
    last = max((curve.last_step for curve in curves), default=-1)
    through = [seed for seed, curve in enumerate(curves) if curve.last_step == last]
    told: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(values[through]), axis=0)
    return told
