"""A run's curves."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from server.metrics.points import Points, downsample
from server.metrics.repository import MetricRepository
from server.metrics.schemas import Metrics, Series
from server.runs.repository import RunRepository
from server.services import Services


class MetricService:
    """Reads curves."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def of_run(self, run_id: str, names: Collection[str] | None, points: int) -> Metrics:
        """The run's series, all or those named, each of at most `points` points.

        Raises:
            NotFoundError: there is no such run.
        """
        with self._services.database.read() as session:
            RunRepository(session).get(run_id)
            series = MetricRepository(session).read(run_id, names)
        return Metrics(series=[_view(name, values, points) for name, values in series.items()])


def _view(name: str, points: Points, limit: int) -> Series:
    buckets = downsample(points, limit)
    return Series(
        name=name,
        steps=buckets.steps.tolist(),
        values=json_numbers(buckets.values),
        min=None if buckets.low is None else json_numbers(buckets.low),
        max=None if buckets.high is None else json_numbers(buckets.high),
    )


def json_numbers(values: NDArray[np.float64]) -> list[float | None]:
    """The values with the seven digits that float32 has; null for nan."""
    return [float(f"{value:.7g}") if finite else None for value, finite in zip(values, np.isfinite(values), strict=True)]
