"""Cuts a run's chunks back to a step, in a few statements however long the run is.

A worker that claims a run waits for it, and every other writer with it: so no chunk is read that stays as it is, and those
that are cut are updated without being made objects. Only their counts change: packing them anew would take many times as
long.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
from sqlalchemy import CursorResult, Table, bindparam, delete, func, select, update
from sqlalchemy.orm import Session

from server.database import tables
from server.metrics.axes import AxisRepository
from server.metrics.points import Points

_CHUNKS = cast("Table", tables.MetricChunk.__table__)
_OF_RUN = _CHUNKS.c.run_id == bindparam("run")
_BEYOND = delete(_CHUNKS).where(_OF_RUN, _CHUNKS.c.first_step > bindparam("step"))
# The last chunks by the index alone: a run has hundreds.
_LAST = (
    select(_CHUNKS.c.name, func.max(_CHUNKS.c.first_step).label("first_step"))
    .where(_OF_RUN)
    .group_by(_CHUNKS.c.name)
    .subquery()
)
_STRADDLING = (
    select(_CHUNKS.c.run_id, _CHUNKS.c.name, _CHUNKS.c.first_step, _CHUNKS.c.count, _CHUNKS.c.points, _CHUNKS.c.axis)
    .join(_LAST, (_LAST.c.name == _CHUNKS.c.name) & (_LAST.c.first_step == _CHUNKS.c.first_step))
    .where(_OF_RUN, _CHUNKS.c.last_step > bindparam("step"))
)
_CUT = (
    update(_CHUNKS)
    .where(_OF_RUN, _CHUNKS.c.name == bindparam("of_series"), _CHUNKS.c.first_step == bindparam("from_step"))
    .values(count=bindparam("kept"), last_step=bindparam("until_step"))
)


@dataclass(frozen=True, slots=True)
class _Straddling:
    """A chunk with points on both sides of the cut."""

    run_id: str
    name: str
    first_step: int
    count: int
    points: bytes
    axis: str | None


def cut_chunks(session: Session, axes: AxisRepository, run_id: str, step: int) -> dict[str, Points]:
    """Forget the points after `step` that are in chunks; what is left of the chunks that were cut, by series."""
    dropped = cast("CursorResult[object]", session.execute(_BEYOND, {"run": run_id, "step": step})).rowcount
    straddling = [_Straddling(*row) for row in session.execute(_STRADDLING, {"run": run_id, "step": step})]
    left: dict[str, Points] = {}
    cuts: list[dict[str, str | int]] = []
    for chunk, points in axes.decoded(straddling):
        kept = points[: int(np.searchsorted(points.steps, step, side="right"))]
        left[chunk.name] = kept
        cuts.append(
            {
                "run": run_id,
                "of_series": chunk.name,
                "from_step": chunk.first_step,
                "kept": len(kept),
                "until_step": int(kept.steps[-1]),
            }
        )
    if cuts:
        session.execute(_CUT, cuts)
    if dropped:
        axes.drop_unused(run_id)
    return left
