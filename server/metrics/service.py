"""A run's curves."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
import orjson
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from server.metrics.buckets import SUMMARY_WIDTH, Buckets
from server.metrics.lines import Line, cut_lines
from server.metrics.points import Points
from server.metrics.repository import MetricRepository
from server.metrics.thinning import ThinningRepository
from server.metrics.views import thinned_view
from server.runs.repository import PointsState, RunRepository
from server.services import Services

# Powers of ten that a float64 holds exactly.
_POWERS = np.array([float(f"1e{power}") for power in range(23)])


@dataclass(frozen=True, slots=True)
class Known:
    """What whoever asks has been told: the newest step of all series, and the attempt whose points they were."""

    step: int
    attempt: int


class MetricService:
    """Reads curves."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def state(self, run_id: str) -> PointsState:
        """What a run's curves depend on: as long as it is the same, so are they.

        Raises:
            NotFoundError: there is no such run.
        """
        with self._services.database.read() as session:
            return RunRepository(session).points_state(run_id)

    def of_run(self, run_id: str, names: Collection[str] | None, points: int, known: Known | None = None) -> bytes:
        """`Metrics` as JSON: the run's series, all or those named, each of at most `points` points, beyond what is known.

        Raises:
            NotFoundError: there is no such run.
        """
        with self._services.database.read() as session:
            run = RunRepository(session).points_state(run_id)

            def read() -> bytes:
                repository, since = MetricRepository(session), None
                fresh: Mapping[str, Points] | None = None
                if known is not None and _goes_on(session, run, known):
                    fresh = repository.since(run_id, names, known.step)
                if known is not None and fresh is not None:
                    series, since = {name: Buckets.of(each).cut(points) for name, each in fresh.items()}, known.step
                else:
                    series = self._curves(repository, run, names, points)
                return _written(series, run, since)

            return self._services.curves.get((run, frozenset(names or ()), points, known), read)

    def _curves(
        self, repository: MetricRepository, run: PointsState, names: Collection[str] | None, points: int
    ) -> dict[str, Buckets]:
        if names is None and points <= SUMMARY_WIDTH:
            return cut_lines(lines_of_run(self._services, repository, run), points)
        return repository.curves([run.run_id], names, points)[run.run_id]


def lines_of_run(services: Services, repository: MetricRepository, run: PointsState) -> Mapping[str, Line]:
    """All series of a run, fine enough for `SUMMARY_WIDTH`, as the repository's transaction sees them."""
    return services.series.of(run, repository)


def _goes_on(session: Session, run: PointsState, known: Known) -> bool:
    """Whether what is new can be put behind what is known."""
    # What a damaged checkpoint took back is beyond the run's step.
    if known.attempt != run.attempt or known.step > run.step:
        return False
    return run.thinned_at is None or known.step >= ThinningRepository(session).reach(run.run_id)


def _written(series: Mapping[str, Buckets], run: PointsState, since: int | None) -> bytes:
    """`Metrics` as JSON, written from the arrays: as lists of numbers they would take five times as long."""
    thinned = thinned_view(run)
    metrics = {
        "series": [_numbers(name, buckets) for name, buckets in series.items()],
        "attempt": run.attempt,
        "thinned": None if thinned is None else thinned.model_dump(),
        "since": since,
    }
    return orjson.dumps(metrics, option=orjson.OPT_SERIALIZE_NUMPY)


def _numbers(name: str, buckets: Buckets) -> dict[str, object]:
    """A `Series`; what is not a number becomes null."""
    single = buckets.single
    return {
        "name": name,
        "steps": buckets.steps,
        "values": buckets.mean.astype(np.float32),
        "min": None if single else buckets.low.astype(np.float32),
        "max": None if single else buckets.high.astype(np.float32),
    }


def json_numbers(values: NDArray[np.float64]) -> list[float | None]:
    """The values, (n,), with the seven digits that float32 has; null for nan."""
    return json_rows(values[None])[0]


def json_rows(values: NDArray[np.float64]) -> list[list[float | None]]:
    """`json_numbers` of each row of (rows, n): of many at once in a third of the time."""
    finite = np.isfinite(values)
    known = np.where(finite, values, 0.0)
    # Decimals that leave seven digits; of other sizes, which are rare, each number is written out.
    places = 6 - np.floor(np.log10(np.abs(np.where(known == 0.0, 1.0, known)))).astype(np.int64)
    usual = (places >= 0) & (places < _POWERS.size)
    scale = _POWERS[np.where(usual, places, 0)]
    rows: list[list[float | None]] = (np.round(known * scale) / scale).tolist()
    for row, index in np.argwhere(~(finite & usual)).tolist():
        rows[row][index] = float(f"{values[row, index]:.7g}") if finite[row, index] else None
    return rows
