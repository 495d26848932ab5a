"""Axes in SQL: steps and times of points, once for all series of a run that were reported together."""

import functools
from collections.abc import Iterable, Iterator
from hashlib import blake2b
from typing import Protocol, TypeVar, cast

from sqlalchemy import Table, bindparam, delete, select, tuple_
from sqlalchemy.orm import Session

from server.database import tables
from server.metrics.points import Axis, Points

_AXES_A_QUERY = 500
# Decoded ones that are remembered within a transaction: those of a run's last chunks are asked for again and again.
_MAX_REMEMBERED = 64

_AXES = cast("Table", tables.MetricAxis.__table__)
_DROP_UNUSED = delete(_AXES).where(
    _AXES.c.run_id == bindparam("run"),
    _AXES.c.id.not_in(
        select(tables.MetricChunk.axis).where(
            tables.MetricChunk.run_id == bindparam("run"), tables.MetricChunk.axis.is_not(None)
        )
    ),
)


class _Chunk(Protocol):
    """As much of a chunk as its points take."""

    @property
    def run_id(self) -> str: ...
    @property
    def axis(self) -> str | None: ...
    @property
    def points(self) -> bytes: ...
    @property
    def count(self) -> int: ...


_C = TypeVar("_C", bound=_Chunk)


class AxisRepository:
    """Reads and writes axes within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session
        # Those that this transaction knows to be there.
        self._kept: set[tuple[str, str]] = set()
        self._decoded: dict[tuple[str, str], Axis] = {}

    def keep(self, run_id: str, points: Points) -> str:
        """The id of the axis on which the points lie, which is written where it is new."""
        key = digest(points)
        if (run_id, key) not in self._kept:
            if self._session.get(tables.MetricAxis, (run_id, key)) is None:
                self._session.add(tables.MetricAxis(run_id=run_id, id=key, data=points.encode_axis()))
            self._kept.add((run_id, key))
        return key

    def decoded(self, chunks: Iterable[_C]) -> Iterator[tuple[_C, Points]]:
        """The chunks with their points, in order; an axis that many lie on is read and decoded once."""
        found = list(chunks)
        axes = self._axes({(chunk.run_id, chunk.axis) for chunk in found if chunk.axis is not None})
        for chunk in found:
            if chunk.axis is None:
                yield chunk, Points.decode(chunk.points, chunk.count)
            else:
                yield chunk, Points.decode_parts(axes[chunk.run_id, chunk.axis], chunk.points, chunk.count)

    def drop_unused(self, run_id: str) -> None:
        """Forget the axes of a run on which nothing lies any more."""
        self._session.execute(_DROP_UNUSED, {"run": run_id})
        self._kept.clear()

    def _axes(self, keys: set[tuple[str, str]]) -> dict[tuple[str, str], Axis]:
        axis = tables.MetricAxis
        axes = {key: self._decoded[key] for key in keys if key in self._decoded}
        wanted = sorted(keys - axes.keys())
        for start in range(0, len(wanted), _AXES_A_QUERY):
            some = wanted[start : start + _AXES_A_QUERY]
            query = select(axis.run_id, axis.id, axis.data).where(tuple_(axis.run_id, axis.id).in_(some))
            axes |= {(run_id, key): _unpacked(data) for run_id, key, data in self._session.execute(query)}
        # An axis is called by what it is: what is remembered is true for as long as it is asked for.
        for key in wanted[: _MAX_REMEMBERED - len(self._decoded)]:
            self._decoded[key] = axes[key]
        return axes


# As many as *Compare* asks for with each of its charts: two of each of fifty runs, and some.
@functools.lru_cache(maxsize=128)
def _unpacked(data: bytes) -> Axis:
    """The axis, which others may have, too: nobody can change it."""
    axis = Axis.decode(data)
    axis.steps.flags.writeable = axis.times.flags.writeable = False
    return axis


def digest(points: Points) -> str:
    """What the axis of these points is called: the same for the same steps and times."""
    return blake2b(points.steps.tobytes() + points.times.tobytes(), digest_size=8).hexdigest()
