"""Thinning in SQL: a series' points give way to buckets of neighbours, which tell how many they were.

The buckets' means take the points' place in the chunks, at the last step and time of each, so that whoever reads points
reads those. Beside them stands what a mean loses: counts and extremes (`tables.ThinnedSeries`).
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import bindparam, func, select
from sqlalchemy.orm import Session

from server.database import tables
from server.metrics.buckets import Buckets
from server.metrics.lines import Line
from server.metrics.points import Points

EVALUATIONS = "eval/"
"""What evaluations are reported as: never thinned."""

_BEYOND = select(tables.ThinnedSeries).where(
    tables.ThinnedSeries.run_id == bindparam("run"), tables.ThinnedSeries.last_step > bindparam("step")
)


@dataclass(frozen=True, slots=True, eq=False)
class Thinned:
    """What is left of a series.

    Attributes:
        name: of it.
        buckets: of all its points.
        points: their means, at the last step and time of each.
    """

    name: str
    buckets: Buckets
    points: Points


def thinned(name: str, points: Points, before: Buckets | None, limit: int, stops: Sequence[int]) -> Thinned:
    """A series in at most `limit` buckets.

    Args:
        name: of it.
        points: all of it; means where it has been thinned before.
        before: what was thinned before; None where nothing was.
        limit: well above twice as many as there are stops.
        stops: steps to which the run may be taken back: no bucket reaches across one, and the last point up to each stands
            alone, as the newest of all does.
    """
    buckets = Line(before, points).buckets.cut(limit, np.asarray(stops, np.int64))
    times = points.times[np.searchsorted(points.steps, buckets.steps)]
    return Thinned(name, buckets, Points(buckets.steps, times, buckets.mean.astype(np.float32)))


def thinned_row(run_id: str, name: str, buckets: Buckets) -> tables.ThinnedSeries:
    """The row of a series of which these are the buckets."""
    return tables.ThinnedSeries(
        run_id=run_id,
        name=name,
        points=int(buckets.sizes.sum()),
        buckets=len(buckets),
        last_step=int(buckets.steps[-1]),
        data=buckets.encode(),
    )


class ThinningRepository:
    """Reads and writes what is known of thinned series, within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def of(self, run_ids: Collection[str], names: Collection[str] | None = None) -> dict[tuple[str, str], Buckets]:
        """The buckets of these runs' thinned series, all or those of `names`, by run and name."""
        row = tables.ThinnedSeries
        query = select(row).where(row.run_id.in_(run_ids))
        if names is not None:
            query = query.where(row.name.in_(names))
        return {(each.run_id, each.name): Buckets.decode(each.data, each.buckets) for each in self._session.scalars(query)}

    def reach(self, run_id: str) -> int:
        """The last step of a run that stands in a bucket; -1 where none does."""
        row = tables.ThinnedSeries
        last = self._session.scalar(select(func.max(row.last_step)).where(row.run_id == run_id))
        return -1 if last is None else last

    def longer_than(self, run_ids: Collection[str], limit: int) -> dict[tuple[str, str], int]:
        """Series of these runs that could be thinned and have more points than `limit`, and how many; chunks alone count."""
        chunk, count = tables.MetricChunk, func.sum(tables.MetricChunk.count)
        query = (
            select(chunk.run_id, chunk.name, count)
            .where(chunk.run_id.in_(run_ids), chunk.name.not_like(f"{EVALUATIONS}%"))
            .group_by(chunk.run_id, chunk.name)
            .having(count > limit)
            .order_by(chunk.run_id, chunk.name)
        )
        return {(run_id, name): int(points) for run_id, name, points in self._session.execute(query)}

    def write(self, run_id: str, series: Iterable[Thinned]) -> None:
        """Write down what they are now, and what it comes to for the run."""
        for each in series:
            self._session.merge(thinned_row(run_id, each.name, each.buckets))
        self._session.flush()
        self._add_up(run_id)

    def forget_beyond(self, run_id: str, step: int) -> None:
        """Forget every bucket that reaches beyond a step."""
        beyond = self._session.scalars(_BEYOND, {"run": run_id, "step": step}).all()
        for each in beyond:
            buckets = Buckets.decode(each.data, each.buckets)
            kept = buckets[: int(np.searchsorted(buckets.steps, step, side="right"))]
            if len(kept):
                self._session.merge(thinned_row(run_id, each.name, kept))
            else:
                self._session.delete(each)
        if beyond:
            self._session.flush()
            self._add_up(run_id)

    def _add_up(self, run_id: str) -> None:
        row = tables.ThinnedSeries
        sums = select(func.sum(row.points), func.sum(row.buckets), func.count()).where(row.run_id == run_id)
        points, buckets, count = self._session.execute(sums).one()
        run = self._session.get_one(tables.Run, run_id)
        run.thinned_from, run.thinned_to = (int(points), int(buckets)) if count else (None, None)
        if not count:
            run.thinned_at = None
