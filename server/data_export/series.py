"""All points of a run, a few thousand at a time."""

from collections.abc import Iterator

import numpy as np

from server.database.engine import Database
from server.metrics.points import Points
from server.metrics.repository import MetricRepository

# Some 65,000 points, 200 kB as they are stored.
_CHUNKS_AT_ONCE = 8


def read_series(database: Database, run_id: str) -> Iterator[tuple[str, Points]]:
    """Every point of a run by metric, then by step, in pieces; what is read at once is a transaction of its own.

    Of a run that is going on it is what was there when its metric's turn came.
    """
    with database.read() as session:
        repository = MetricRepository(session)
        waiting = repository.waiting(run_id)
        names = sorted({*repository.compacted(run_id), *waiting})
    for name in names:
        for points in _pieces(database, run_id, name, waiting.pop(name, Points.joined([]))):
            if len(points):
                yield name, points


def _pieces(database: Database, run_id: str, name: str, waiting: Points) -> Iterator[Points]:
    """One series. Of several points with one step the one that waits counts, then that of the later chunk."""
    last, rest = -1, Points.joined([])
    while True:
        with database.read() as session:
            chunks = MetricRepository(session).chunks_after(run_id, name, last, _CHUNKS_AT_ONCE)
        for last, points in chunks:
            # Chunks overlap where points came late: what lies before the next one is settled, the rest is not.
            settled, due = int(np.searchsorted(rest.steps, last)), int(np.searchsorted(waiting.steps, last))
            yield Points.joined([rest[:settled], waiting[:due]])
            rest, waiting = Points.joined([rest[settled:], points]), waiting[due:]
        if len(chunks) < _CHUNKS_AT_ONCE:
            yield Points.joined([rest, waiting])
            return
