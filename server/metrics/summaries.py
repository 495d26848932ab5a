"""Summaries in SQL: as chunks are added, what a long series looks like is kept beside them."""

from collections.abc import Collection
from typing import cast

import numpy as np
from sqlalchemy import Table, bindparam, delete, select, update
from sqlalchemy.orm import Session

from server.database import tables
from server.metrics.buckets import Buckets

_SUMMARIES = cast("Table", tables.MetricSummary.__table__)
_OF_RUN = _SUMMARIES.c.run_id == bindparam("run")
_BEYOND = select(_SUMMARIES.c.name, _SUMMARIES.c.buckets, _SUMMARIES.c.data).where(
    _OF_RUN, _SUMMARIES.c.last_step > bindparam("step")
)
# The newest point is left standing, which nobody reads any more: a row that keeps its length is changed where it lies, and
# what it holds need not be written again.
_CUT = (
    update(_SUMMARIES)
    .where(_OF_RUN, _SUMMARIES.c.name == bindparam("of_series"))
    .values(buckets=bindparam("kept"), last_step=bindparam("until_step"))
)
_EMPTY = delete(_SUMMARIES).where(_OF_RUN, _SUMMARIES.c.buckets == 0)


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
        cuts: list[dict[str, str | int]] = []
        for name, count, data in self._session.execute(_BEYOND, {"run": run_id, "step": step}):
            steps = Buckets.steps_in(data, count)
            kept = int(np.searchsorted(steps, step, side="right"))
            last_step = int(steps[kept - 1]) if kept else -1
            cuts.append({"run": run_id, "of_series": name, "kept": kept, "until_step": last_step})
        if cuts:
            self._session.execute(_CUT, cuts)
        if not all(cut["kept"] for cut in cuts):
            self._session.execute(_EMPTY, {"run": run_id})


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
    return Buckets.joined([buckets, Buckets.single_point(summary.last_step, summary.newest)])
