"""Points in long form: a row each."""

from collections.abc import Iterable, Iterator

import numpy as np

from server.metrics.points import Points
from server.spreadsheets import csv_rows

HEADING = csv_rows([("run", "seed", "metric", "step", "wall_time", "value")])


def point_rows(run_id: str, seed: int, series: Iterable[tuple[str, Points]]) -> Iterator[bytes]:
    """A run's points as CSV without a heading, block by block.

    Values have the digits that give the same float32 again; what was not finite is an empty cell.
    """
    for name, points in series:
        values = np.where(np.isfinite(points.values), points.values.astype(str), "")
        columns = (points.steps.tolist(), points.times.tolist(), values.tolist())
        yield _numbers(csv_rows([(run_id, seed, name)]), *columns)


def _numbers(beginning: bytes, steps: list[int], times: list[float], values: list[str]) -> bytes:
    """Rows that begin alike; a negative number is no text, so that no cell of theirs needs to be looked at."""
    same = beginning.decode().removesuffix("\r\n")
    rows = (f"{same},{step},{time!r},{value}\r\n" for step, time, value in zip(steps, times, values, strict=True))
    return "".join(rows).encode()
