"""All points of a run, a few thousand at a time."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from server.database import tables
from server.database.engine import Database
from server.errors import ConflictError
from server.metrics.buckets import Buckets
from server.metrics.points import Points
from server.metrics.repository import MetricRepository
from server.metrics.thinning import ThinningRepository

# Some 65,000 points, 200 kB as they are stored.
_CHUNKS_AT_ONCE = 8


class ThinnedMeanwhileError(ConflictError):
    """A run's curves were thinned while they were read: what was read and what is left do not fit together."""

    def __init__(self) -> None:
        super().__init__("The curves were thinned while they were on their way: ask for them again.")


@dataclass(frozen=True, eq=False)
class RunSeries:
    """What there is to tell of a run's points.

    Attributes:
        thinned: the buckets of series of which the first points are means, by name.
        pieces: every point by metric, then by step, in pieces; what is read at once is a transaction of its own. Of a run
            that is going on it is what was there when its metric's turn came. Reading on raises `ThinnedMeanwhileError`
            where they have been thinned since.
    """

    thinned: Mapping[str, Buckets]
    pieces: Iterator[tuple[str, Points]]


def read_run(database: Database, run_id: str) -> RunSeries:
    """The points of a run."""
    with database.read() as session:
        repository = MetricRepository(session)
        waiting = repository.waiting(run_id)
        names = sorted({*repository.compacted(run_id), *waiting})
        state = _thinned_at(session.get(tables.Run, run_id))
        thinned = ThinningRepository(session).of([run_id]) if state is not None else {}
    buckets = {name: each for (_, name), each in thinned.items()}
    return RunSeries(buckets, _all(database, run_id, names, waiting, state))


def read_series(database: Database, run_id: str) -> Iterator[tuple[str, Points]]:
    """The pieces of `read_run`."""
    return read_run(database, run_id).pieces


def stood_for(points: Points, thinned: Buckets | None) -> Buckets:
    """What each of these points of a series stands for: itself, or a bucket where it is the mean of one."""
    alone = Buckets.of(points)
    if thinned is None:
        return alone
    which = np.minimum(np.searchsorted(thinned.steps, points.steps), len(thinned) - 1)
    found = thinned.steps[which] == points.steps
    bucket = thinned[which]
    return Buckets(
        points.steps,
        np.where(found, bucket.sizes, alone.sizes),
        np.where(found, bucket.finite, alone.finite),
        np.where(found, bucket.low, alone.low),
        alone.mean,
        np.where(found, bucket.high, alone.high),
    )


def with_edges(series: RunSeries) -> Iterator[tuple[str, Points]]:
    """The pieces of a run's points; behind one of means the smallest and the largest values, as series of their own."""
    for name, points in series.pieces:
        yield name, points
        if name in series.thinned:
            each = stood_for(points, series.thinned[name])
            for edge, values in (("min", each.low), ("max", each.high)):
                yield f"{name} ({edge})", Points(points.steps, points.times, values.astype(np.float32))


def said_of(series: RunSeries) -> str | None:
    """That curves were thinned, and how much of each is left, as a sentence; None where none was."""
    if not series.thinned:
        return None
    each = ", ".join(f"{name} {int(one.sizes.sum())} to {len(one)}" for name, one in sorted(series.thinned.items()))
    return (
        f"Curves were thinned: neighbouring points were put together, of which mean, min and max are left. Points: {each}."
    )


def _all(
    database: Database, run_id: str, names: list[str], waiting: dict[str, Points], state: float | None
) -> Iterator[tuple[str, Points]]:
    for name in names:
        for points in _pieces(database, run_id, name, waiting.pop(name, Points.joined([])), state):
            if len(points):
                yield name, points


def _pieces(database: Database, run_id: str, name: str, waiting: Points, state: float | None) -> Iterator[Points]:
    """One series. Of several points with one step the one that waits counts, then that of the later chunk."""
    last, rest = -1, Points.joined([])
    while True:
        with database.read() as session:
            if _thinned_at(session.get(tables.Run, run_id)) != state:
                raise ThinnedMeanwhileError
            chunks = MetricRepository(session).chunks_after(run_id, name, last, _CHUNKS_AT_ONCE)
        for last, points in chunks:
            # Chunks overlap where points came late: what lies before the next one is settled, the rest is not.
            settled, due = int(np.searchsorted(rest.steps, last)), int(np.searchsorted(waiting.steps, last))
            yield Points.joined([rest[:settled], waiting[:due]])
            rest, waiting = Points.joined([rest[settled:], points]), waiting[due:]
        if len(chunks) < _CHUNKS_AT_ONCE:
            yield Points.joined([rest, waiting])
            return


def _thinned_at(run: tables.Run | None) -> float | None:
    return None if run is None else run.thinned_at
