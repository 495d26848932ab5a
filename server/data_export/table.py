"""Points in long form: a row each."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from server.data_export.columns import BUCKETS, POINTS, heading
from server.data_export.series import RunSeries, ThinnedMeanwhileError, stood_for
from server.spreadsheets import csv_rows

HEADING = csv_rows([heading(POINTS)])
WIDE_HEADING = csv_rows([heading((*POINTS, *BUCKETS))])
"""Of a file with curves that were thinned: how many points a row stands for, their smallest and their largest value."""


def point_rows(run_id: str, seed: int, series: RunSeries, *, wide: bool) -> Iterator[bytes]:
    """A run's points as CSV without a heading, block by block.

    Values have the digits that give the same float32 again; what was not finite is an empty cell.

    Args:
        run_id: of the run.
        seed: of the run.
        series: its points.
        wide: with the columns of `WIDE_HEADING`.

    Raises:
        ThinnedMeanwhileError: it was thinned, which the heading does not say.
    """
    if series.thinned and not wide:
        raise ThinnedMeanwhileError
    for name, points in series.pieces:
        columns: list[list[Any]] = [points.steps.tolist(), points.times.tolist(), _cells(points.values)]
        if wide:
            each = stood_for(points, series.thinned.get(name))
            columns += [each.sizes.tolist(), _cells(each.low), _cells(each.high)]
        yield _numbers(csv_rows([(run_id, seed, name)]), columns)


def _cells(values: NDArray[np.floating]) -> list[str]:
    short = values.astype(np.float32)
    cells: list[str] = np.where(np.isfinite(short), short.astype(str), "").tolist()
    return cells


def _numbers(beginning: bytes, columns: list[list[Any]]) -> bytes:
    """Rows that begin alike; a negative number is no text, so that no cell of theirs needs to be looked at."""
    same = beginning.decode().removesuffix("\r\n")
    if len(columns) == 3:
        rows = (f"{same},{step},{time!r},{value}\r\n" for step, time, value in zip(*columns, strict=True))
    else:
        rows = (
            f"{same},{step},{time!r},{value},{count},{low},{high}\r\n"
            for step, time, value, count, low, high in zip(*columns, strict=True)
        )
    return "".join(rows).encode()
