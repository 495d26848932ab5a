"""Summaries in SQL: as chunks are added, what a long series looks like is kept beside them."""

from collections.abc import Collection

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from server.database import tables
from server.metrics.buckets import Buckets
from server.metrics.points import Points


class SummaryRepository:
    """Reads and writes summaries within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def of(self, run_ids: Collection[str], names: Collection[str] | None = None) -> list[tables.MetricSummary]:
        """The summaries of these runs, all or those of `names`; a series that is not long has none."""
        query = select(tables.MetricSummary).where(tables.MetricSummary.run_id.in_(run_ids))
        if names is not None:
            query = query.where(tables.MetricSummary.name.in_(names))
        return list(self._session.scalars(query))

    def write(self, run_id: str, name: str, buckets: Buckets) -> None:
        """Write down what a series looks like, of which these are all the buckets."""
        self._session.merge(summary_of(run_id, name, buckets))

    def cut(self, run_id: str, step: int) -> None:
        """Forget every bucket that reaches beyond `step`, and the newest point with it."""
        for summary in self.of([run_id]):
            if summary.last_step <= step:
                continue
            steps = Buckets.steps_in(summary.data, summary.buckets)
            summary.buckets = int(np.searchsorted(steps, step, side="right"))
            if summary.buckets == 0:
                self._session.delete(summary)
            else:
                summary.last_step, summary.newest = int(steps[summary.buckets - 1]), None
        self._session.flush()


def summary_of(run_id: str, name: str, buckets: Buckets) -> tables.MetricSummary:
    """The summary of a series of which these are all the buckets."""
    # The newest point stays apart: a curve ends where it ends, not with a mean.
    summary = buckets[:-1].widened()
    return tables.MetricSummary(
        run_id=run_id,
        name=name,
        buckets=len(summary),
        last_step=int(buckets.steps[-1]),
        newest=float(buckets.mean[-1]) if buckets.finite[-1] else None,
        data=summary.encode(),
    )


def summarized(summary: tables.MetricSummary) -> Buckets:
    """What a summary knows, its newest point last."""
    buckets = Buckets.decode(summary.data, summary.buckets)
    if summary.last_step == buckets.steps[-1]:
        return buckets
    newest = Points.of([summary.last_step], [0.0], [summary.newest])
    return Buckets.joined([buckets, Buckets.of(newest)])
