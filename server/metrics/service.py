"""A run's curves."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from server.metrics.buckets import Buckets
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
            series = MetricRepository(session).curves([run_id], names, points)[run_id]
        return Metrics(series=[_view(name, buckets) for name, buckets in series.items()])


def _view(name: str, buckets: Buckets) -> Series:
    return Series(
        name=name,
        steps=buckets.steps.tolist(),
        values=json_numbers(buckets.mean),
        min=None if buckets.single else json_numbers(buckets.low),
        max=None if buckets.single else json_numbers(buckets.high),
    )


def json_numbers(values: NDArray[np.float64]) -> list[float | None]:
    """The values with the seven digits that float32 has; null for nan."""
    return [float(f"{value:.7g}") if finite else None for value, finite in zip(values, np.isfinite(values), strict=True)]
