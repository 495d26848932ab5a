"""Metrics in SQL: rows as they come, compacted into chunks, and the newest value of each series beside them."""

import math
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple, cast

import numpy as np
from sqlalchemy import Table, bindparam, delete, func, insert, select, tuple_
from sqlalchemy.orm import Session, aliased

from server.database import tables
from server.http.abandoned import stop_if_abandoned
from server.metrics.axes import AxisRepository, digest
from server.metrics.buckets import SUMMARY_WIDTH, Buckets
from server.metrics.cutting import cut_chunks
from server.metrics.latest import set_latest
from server.metrics.lines import Line, cut_lines
from server.metrics.points import Points
from server.metrics.summaries import SummaryRepository, summarized, summary_of
from server.metrics.thinning import Thinned, ThinningRepository, thinned_row

# Rows that wait for compaction: few enough to be read in milliseconds, many enough that chunks are worth their overhead.
COMPACT_AFTER = 500
# Points of a full chunk; a smaller one is grown by the next compaction.
_CHUNK_POINTS = 8_192
# A series of more points has a summary.
_LONG = 4_096
# Rows in one INSERT; SQLite takes at most 32,766 parameters.
_INSERT_ROWS = 1_000
_RUNS_A_QUERY = 1_000
_ROWS = cast("Table", tables.MetricRow.__table__)
_LATEST = cast("Table", tables.LatestMetric.__table__)
# Put together once: a claim waits for them.
_ROWS_BEYOND = delete(_ROWS).where(_ROWS.c.run_id == bindparam("run"), _ROWS.c.step > bindparam("step"))
_ROWS_FROM_THE_END = (
    select(_ROWS.c.step, _ROWS.c["values"])
    .where(_ROWS.c.run_id == bindparam("run"))
    .order_by(_ROWS.c.seq.desc())
    .execution_options(yield_per=16)
)
_OF_THESE = (
    tables.MetricChunk.run_id == bindparam("run"),
    tables.MetricChunk.name.in_(bindparam("names", expanding=True)),
)
_LAST = (
    select(tables.MetricChunk.name, func.max(tables.MetricChunk.first_step).label("first_step"))
    .where(*_OF_THESE)
    .group_by(tables.MetricChunk.name)
    .subquery()
)
_LAST_CHUNKS = (
    select(tables.MetricChunk)
    .where(*_OF_THESE)
    .join(_LAST, (_LAST.c.name == tables.MetricChunk.name) & (_LAST.c.first_step == tables.MetricChunk.first_step))
)
_LATEST_BEYOND = (
    delete(_LATEST).where(_LATEST.c.run_id == bindparam("run"), _LATEST.c.step > bindparam("step")).returning(_LATEST.c.name)
)


@dataclass(frozen=True, slots=True)
class ReportedRow:
    """Metrics of one step as a worker numbered them: `seq` grows by one from message to message, over all attempts."""

    seq: int
    step: int
    wall_time: float
    values: Mapping[str, float]


class WaitingRow(NamedTuple):
    """Metrics of one step that wait for compaction."""

    step: int
    wall_time: float
    values: Mapping[str, float | None]


class MetricRepository:
    """Reads and writes metrics within the caller's transaction, so that they are committed with what belongs to them."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._summaries = SummaryRepository(session)
        self._axes = AxisRepository(session)
        self._thinning = ThinningRepository(session)

    def append(self, rows: Mapping[str, Sequence[ReportedRow]]) -> None:
        """Add rows that came in order, by run; those that are there already, as rows or in chunks, must not be among them.

        `Run.last_seq` is left to the caller, who moves it in the same transaction once everything numbered so far is stored.
        """
        fresh = [(run_id, row) for run_id, reported in rows.items() for row in reported if row.values]
        self._session.flush()
        for start in range(0, len(fresh), _INSERT_ROWS):
            self._session.connection().execute(
                insert(_ROWS),
                [
                    {
                        "run_id": run_id,
                        "seq": row.seq,
                        "step": row.step,
                        "wall_time": row.wall_time,
                        "values": {name: value if math.isfinite(value) else None for name, value in row.values.items()},
                    }
                    for run_id, row in fresh[start : start + _INSERT_ROWS]
                ],
            )
        newest = {
            (run_id, name): (row.step, value)
            for run_id, row in fresh
            for name, value in row.values.items()
            if math.isfinite(value)
        }
        set_latest(self._session, newest)

    def needs_compaction(self, run_id: str) -> bool:
        """Whether enough rows wait."""
        return self._count_rows(run_id) >= COMPACT_AFTER

    def compact(self, run_id: str) -> None:
        """Move the run's rows into chunks."""
        self._extend(run_id, _series(self._rows(run_id)))
        self._session.execute(delete(tables.MetricRow).where(tables.MetricRow.run_id == run_id))
        self._session.flush()

    def add_series(self, run_id: str, series: Mapping[str, Points]) -> None:
        """Add whole series at once, as chunks: what a benchmark brings, without a row for every step."""
        self._extend(run_id, series)
        self._session.flush()
        newest = {name: last for name, points in series.items() if (last := _last_finite(points)) is not None}
        self._set_latest(run_id, newest)

    def thin(self, run_id: str, series: Sequence[Thinned]) -> None:
        """Put what is left of these series in place of their points; none of those may wait as rows."""
        names = [each.name for each in series]
        for table in (tables.MetricChunk, tables.MetricSummary):
            self._session.execute(delete(table).where(table.run_id == run_id, table.name.in_(names)))
        for each in series:
            self._add_chunks(run_id, each.name, each.points)
        self._session.flush()
        self._axes.drop_unused(run_id)
        self._thinning.write(run_id, series)

    def add_packed(self, run_id: str, packed: "PackedSeries") -> None:
        """Add the series of a run that has none yet: nothing is left to compute while the database is held."""
        self._session.add_all(packed.rows)
        self._session.flush()
        self._set_latest(run_id, packed.newest)

    def drop_beyond(self, run_id: str, step: int) -> None:
        """Forget every point after `step`: what a lost attempt did after the checkpoint from which the next one resumes."""
        self._session.flush()
        beyond = {"run": run_id, "step": step}
        self._session.execute(_ROWS_BEYOND, beyond)
        left = cut_chunks(self._session, self._axes, run_id, step)
        self._summaries.cut(run_id, step)
        self._thinning.forget_beyond(run_id, step)
        lost = set(self._session.scalars(_LATEST_BEYOND, beyond))
        self._set_latest(run_id, self._newest(run_id, lost, left))

    def _newest(self, run_id: str, names: Collection[str], last: Mapping[str, Points]) -> dict[str, tuple[int, float]]:
        """Step and value of the newest number of each of these series, looked for from the end.

        Args:
            run_id: whose they are.
            names: of the series.
            last: the points of the last chunks that are at hand, by series.
        """
        newest: dict[str, tuple[int, float]] = {}
        if not names:
            return newest
        for step, values in self._session.execute(_ROWS_FROM_THE_END, {"run": run_id}):
            for name, value in values.items():
                if name in names and value is not None:
                    newest.setdefault(name, (step, value))
            if len(newest) == len(names):
                return newest
        missing = [name for name in names if name not in newest]
        if unread := [name for name in missing if name not in last]:
            chunks = self._axes.decoded(self._last_chunks(run_id, unread).values())
            last = {**last, **{chunk.name: points for chunk, points in chunks}}
        for name in missing:
            if (points := last.get(name)) is not None:
                found = _last_finite(points) or _last_finite(self.read(run_id, [name])[name])
                if found is not None:
                    newest[name] = found
        return newest

    def read(self, run_id: str, names: Collection[str] | None = None) -> dict[str, Points]:
        """The run's series by name, all or those of `names` that it has."""
        return self.read_many([run_id], names)[run_id]

    def read_many(self, run_ids: Collection[str], names: Collection[str] | None = None) -> dict[str, dict[str, Points]]:
        """The series of each of several runs, by run and name, in as many queries as for one."""
        return self._read(run_ids, names, beyond_summaries=False)

    def _read(
        self, run_ids: Collection[str], names: Collection[str] | None, *, beyond_summaries: bool
    ) -> dict[str, dict[str, Points]]:
        """All points of the series, or those alone that no summary knows."""
        parts: dict[str, dict[str, list[Points]]] = {run_id: defaultdict(list) for run_id in run_ids}
        for some in _portions(run_ids):
            chunks = select(tables.MetricChunk).where(tables.MetricChunk.run_id.in_(some))
            if names is not None:
                chunks = chunks.where(tables.MetricChunk.name.in_(names))
            if beyond_summaries:
                chunks = chunks.outerjoin(
                    tables.MetricSummary,
                    (tables.MetricSummary.run_id == tables.MetricChunk.run_id)
                    & (tables.MetricSummary.name == tables.MetricChunk.name),
                ).where(
                    tables.MetricSummary.run_id.is_(None) | (tables.MetricChunk.last_step > tables.MetricSummary.last_step)
                )
            found = self._session.scalars(chunks.order_by(tables.MetricChunk.run_id, tables.MetricChunk.first_step))
            for chunk, points in self._axes.decoded(found):
                stop_if_abandoned()
                parts[chunk.run_id][chunk.name].append(points)
            for run_id, rows in self._rows_of(some).items():
                for name, points in _series(rows).items():
                    if names is None or name in names:
                        parts[run_id][name].append(points)
        return {run_id: {name: Points.joined(series[name]) for name in sorted(series)} for run_id, series in parts.items()}

    def names(self, run_ids: Collection[str], limit: int) -> list[tuple[str, int]]:
        """The metrics of which runs have reported a number, at most `limit`, by name, each with how many of them have."""
        reported: dict[str, int] = defaultdict(int)
        for some in _portions(run_ids):
            name = tables.LatestMetric.name
            query = select(name, func.count()).where(tables.LatestMetric.run_id.in_(some)).group_by(name).order_by(name)
            for each, count in self._session.execute(query.limit(limit)):
                reported[each] += count
        return sorted(reported.items())[:limit]

    def waiting(self, run_id: str) -> dict[str, Points]:
        """The points that wait to be compacted, by series."""
        return _series(self._rows(run_id))

    def compacted(self, run_id: str) -> set[str]:
        """The series that have chunks."""
        query = select(tables.MetricChunk.name).where(tables.MetricChunk.run_id == run_id).distinct()
        return set(self._session.scalars(query))

    def chunks_after(self, run_id: str, name: str, first_step: int, limit: int) -> list[tuple[int, Points]]:
        """The next chunks of a series, at most `limit`: those that begin after `first_step`, each with its own."""
        query = (
            select(tables.MetricChunk)
            .where(
                tables.MetricChunk.run_id == run_id,
                tables.MetricChunk.name == name,
                tables.MetricChunk.first_step > first_step,
            )
            .order_by(tables.MetricChunk.first_step)
            .limit(limit)
        )
        return [(chunk.first_step, points) for chunk, points in self._axes.decoded(self._session.scalars(query))]

    def curves(self, run_ids: Collection[str], names: Collection[str] | None, limit: int) -> dict[str, dict[str, Buckets]]:
        """The series of several runs at most `limit` (at least 2) buckets wide, by run and name.

        Of a long series its summary is read, and what came after it, unless more is asked for than the summary shows.
        """
        lines = self._lines(run_ids, names, by_summaries=limit <= SUMMARY_WIDTH)
        return {run_id: cut_lines(series, limit) for run_id, series in lines.items()}

    def lines(self, run_ids: Collection[str], names: Collection[str] | None = None) -> dict[str, dict[str, Line]]:
        """The series, all or those named, as fine as they are known without the points of long ones, by run and name.

        Good for any `SUMMARY_WIDTH` or less.
        """
        return self._lines(run_ids, names, by_summaries=True)

    def _lines(
        self, run_ids: Collection[str], names: Collection[str] | None, *, by_summaries: bool
    ) -> dict[str, dict[str, Line]]:
        summaries = self._summaries.of(run_ids, names) if by_summaries else []
        before: dict[str, dict[str, Buckets]] = defaultdict(dict)
        for (run_id, name), buckets in self._thinning.of(run_ids, names).items():
            before[run_id][name] = buckets
        for summary in summaries:
            before[summary.run_id][summary.name] = summarized(summary)
        none = Points.joined([])
        return {
            run_id: {
                name: Line(before[run_id].get(name), series.get(name, none)) for name in sorted({*series, *before[run_id]})
            }
            for run_id, series in self._read(run_ids, names, beyond_summaries=bool(summaries)).items()
        }

    def since(self, run_id: str, names: Collection[str] | None, step: int) -> dict[str, Points] | None:
        """The points of a run from `step` on, by series; None where they are too many to be read one by one."""
        beyond = [tables.MetricChunk.run_id == run_id, tables.MetricChunk.last_step >= step]
        if names is not None:
            beyond.append(tables.MetricChunk.name.in_(names))
        counted = select(func.count()).where(*beyond).group_by(tables.MetricChunk.name)
        if max(self._session.scalars(counted), default=0) > 1:
            return None
        parts: dict[str, list[Points]] = defaultdict(list)
        for chunk, points in self._axes.decoded(self._session.scalars(select(tables.MetricChunk).where(*beyond))):
            parts[chunk.name].append(points[int(np.searchsorted(points.steps, step)) :])
        for name, points in _series(self._rows(run_id, step)).items():
            if names is None or name in names:
                parts[name].append(points)
        return {name: Points.joined(parts[name]) for name in sorted(parts)}

    def tails(self, run_ids: Collection[str], name: str, step: int) -> tuple[dict[str, Points], dict[str, int]]:
        """One series of several runs from the last point at or before `step` on, and where it began, both by run."""
        chunk, earlier = tables.MetricChunk, aliased(tables.MetricChunk)
        first = select(func.max(earlier.first_step)).where(
            earlier.run_id == chunk.run_id, earlier.name == name, earlier.first_step <= step
        )
        parts: dict[str, list[Points]] = {run_id: [] for run_id in run_ids}
        for some in _portions(run_ids):
            query = select(chunk).where(
                chunk.run_id.in_(some),
                chunk.name == name,
                chunk.first_step >= func.coalesce(first.correlate(chunk).scalar_subquery(), 0),
            )
            found = self._session.scalars(query.order_by(chunk.run_id, chunk.first_step))
            for each, points in self._axes.decoded(found):
                stop_if_abandoned()
                parts[each.run_id].append(points)
            for run_id, rows in self._rows_of(some).items():
                if (points_of := _series(rows).get(name)) is not None:
                    parts[run_id].append(points_of)
        whole = {run_id: Points.joined(each) for run_id, each in parts.items()}
        tails = {
            run_id: points[max(0, int(np.searchsorted(points.steps, step, side="right")) - 1) :]
            for run_id, points in whole.items()
        }
        # Without chunks all that there is was read.
        began = {run_id: int(points.steps[0]) for run_id, points in whole.items() if len(points)}
        return tails, began | self.began(run_ids, name)

    def began(self, run_ids: Collection[str], name: str) -> dict[str, int]:
        """The first step of a series in the chunks of each run that has some."""
        chunk = tables.MetricChunk
        began: dict[str, int] = {}
        for some in _portions(run_ids):
            query = select(chunk.run_id, func.min(chunk.first_step)).where(chunk.run_id.in_(some), chunk.name == name)
            began |= {row[0]: row[1] for row in self._session.execute(query.group_by(chunk.run_id))}
        return began

    def _extend(self, run_id: str, fresh: Mapping[str, Points]) -> None:
        last_chunks = self._last_chunks(run_id, fresh)
        grown = {chunk.name: points for chunk, points in self._axes.decoded(last_chunks.values())}
        known = {summary.name: summary for summary in self._summaries.of([run_id], fresh)}
        whole: dict[str, Points] = {}
        replaced: list[tables.MetricChunk] = []
        for name, points in fresh.items():
            last = last_chunks.get(name)
            whole[name] = points
            # A chunk that isn't full is grown, so that rare series (evaluations) don't end in chunks of one point each.
            if last is not None and (last.count < _CHUNK_POINTS or last.last_step >= points.steps[0]):
                whole[name] = Points.joined([grown[name], points])
                replaced.append(last)
        self._delete_chunks(run_id, replaced)
        for name, points in whole.items():
            self._add_chunks(run_id, name, points)
        self._session.flush()
        for name, points in whole.items():
            last = last_chunks.get(name)
            if name in known or len(points) > _LONG or (last is not None and last.count >= _CHUNK_POINTS):
                self._summarize(run_id, name, known.get(name), int(fresh[name].steps[0]))
        self._session.flush()
        self._axes.drop_unused(run_id)

    def _summarize(self, run_id: str, name: str, known: tables.MetricSummary | None, began: int) -> None:
        """Bring a series' summary up to its chunks, to which points from the step `began` on were added."""
        is_long = known is not None
        if known is not None and began <= known.last_step:
            # Points came late: nothing can be appended, so all is looked at once more.
            known = None
        chunks = select(tables.MetricChunk).where(tables.MetricChunk.run_id == run_id, tables.MetricChunk.name == name)
        if known is not None:
            chunks = chunks.where(tables.MetricChunk.last_step > known.last_step)
        before = summarized(known) if known is not None else self._thinning.of([run_id], [name]).get((run_id, name))
        self._session.flush()
        found = self._session.scalars(chunks.order_by(tables.MetricChunk.first_step))
        points = Points.joined([points for _, points in self._axes.decoded(found)])
        buckets = Line(before, points).buckets
        if is_long or len(buckets) > _LONG:
            self._summaries.write(run_id, name, buckets)

    def _rows(self, run_id: str, from_step: int | None = None) -> list[WaitingRow]:
        return self._rows_of([run_id], from_step).get(run_id, [])

    def _rows_of(self, run_ids: Collection[str], from_step: int | None = None) -> dict[str, list[WaitingRow]]:
        row = tables.MetricRow
        query = select(row.run_id, row.step, row.wall_time, row.values).where(row.run_id.in_(run_ids)).order_by(row.seq)
        if from_step is not None:
            query = query.where(row.step >= from_step)
        rows: dict[str, list[WaitingRow]] = defaultdict(list)
        for run_id, step, wall_time, values in self._session.execute(query):
            rows[run_id].append(WaitingRow(step, wall_time, values))
        return rows

    def _count_rows(self, run_id: str) -> int:
        query = select(func.count()).select_from(tables.MetricRow).where(tables.MetricRow.run_id == run_id)
        return self._session.scalar(query) or 0

    def _last_chunks(self, run_id: str, names: Collection[str]) -> dict[str, tables.MetricChunk]:
        """The last chunk of each of these series that has one."""
        found = self._session.scalars(_LAST_CHUNKS, {"run": run_id, "names": list(names)})
        return {chunk.name: chunk for chunk in found}

    def _delete_chunks(self, run_id: str, chunks: Sequence[tables.MetricChunk]) -> None:
        """In one statement, whose rows the session forgets: others with the same keys may follow."""
        if not chunks:
            return
        chunk = tables.MetricChunk
        keys = [(each.name, each.first_step) for each in chunks]
        for each in chunks:
            self._session.expunge(each)
        self._session.execute(
            delete(chunk).where(chunk.run_id == run_id, tuple_(chunk.name, chunk.first_step).in_(keys)),
            execution_options={"synchronize_session": False},
        )

    def _add_chunks(self, run_id: str, name: str, points: Points) -> None:
        for part in _chunked(points):
            self._session.add(_chunk(run_id, name, part, self._axes.keep(run_id, part)))

    def _set_latest(self, run_id: str, newest: Mapping[str, tuple[int, float]]) -> None:
        set_latest(self._session, {(run_id, name): last for name, last in newest.items()})


@dataclass(frozen=True)
class PackedSeries:
    """All series of a run as rows of the database, before they are in it, and the newest number of each."""

    rows: Sequence[tables.Base]
    newest: Mapping[str, tuple[int, float]]

    @classmethod
    def of(
        cls, run_id: str, series: Mapping[str, Points], thinned: Mapping[str, Buckets] = MappingProxyType({})
    ) -> "PackedSeries":
        """Packs series: the long part of bringing in a run, without a transaction.

        Args:
            run_id: of the run.
            series: by name.
            thinned: the buckets of those whose first points are means of these.
        """
        rows: list[tables.Base] = [thinned_row(run_id, name, buckets) for name, buckets in thinned.items()]
        axes: dict[str, tables.MetricAxis] = {}
        for name, points in series.items():
            for part in _chunked(points):
                axis = digest(part)
                if axis not in axes:
                    axes[axis] = tables.MetricAxis(run_id=run_id, id=axis, data=part.encode_axis())
                rows.append(_chunk(run_id, name, part, axis))
            if len(points) > _LONG:
                rows.append(summary_of(run_id, name, Line(thinned.get(name), points).buckets))
        newest = {name: last for name, points in series.items() if (last := _last_finite(points)) is not None}
        return cls([*axes.values(), *rows], newest)


def _chunked(points: Points) -> Iterator[Points]:
    for start in range(0, len(points), _CHUNK_POINTS):
        yield points[start : start + _CHUNK_POINTS]


def _chunk(run_id: str, name: str, points: Points, axis: str) -> tables.MetricChunk:
    return tables.MetricChunk(
        run_id=run_id,
        name=name,
        first_step=int(points.steps[0]),
        last_step=int(points.steps[-1]),
        count=len(points),
        points=points.encode_values(),
        axis=axis,
    )


def _portions(run_ids: Collection[str]) -> Iterator[list[str]]:
    """The runs in lists that a query takes: SQLite knows 32,766 parameters."""
    ids = list(run_ids)
    for start in range(0, len(ids), _RUNS_A_QUERY):
        yield ids[start : start + _RUNS_A_QUERY]


def _last_finite(points: Points) -> tuple[int, float] | None:
    """Step and value of the newest point that is a number."""
    finite = np.flatnonzero(np.isfinite(points.values))
    return (int(points.steps[finite[-1]]), float(points.values[finite[-1]])) if finite.size else None


def _series(rows: Sequence[WaitingRow]) -> dict[str, Points]:
    """Rows in order as one series a name."""
    # What a run reports together it mostly reports together again: such rows are one table of numbers.
    alike: dict[tuple[str, ...], list[WaitingRow]] = defaultdict(list)
    for row in rows:
        alike[tuple(row.values)].append(row)
    series: dict[str, Points] = {}
    for names, table in alike.items():
        columns = Points.of_table(
            [row.step for row in table], [row.wall_time for row in table], [list(row.values.values()) for row in table]
        )
        series.update(zip(names, columns, strict=True))
    met = Counter(name for names in alike for name in names)
    for name in (name for name, times in met.items() if times > 1):
        among = [row for row in rows if name in row.values]
        series[name] = Points.of(
            [row.step for row in among], [row.wall_time for row in among], [row.values[name] for row in among]
        )
    return series
