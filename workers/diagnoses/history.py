"""A run's curves, and the questions that rules ask of them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workers.config import TrainingConfig

# Fewer points than these say nothing: one odd report would decide.
MIN_POINTS = 5

# The recent part of a run: long enough to be sure, short enough to forget what is over.
_RECENT = 0.25


@dataclass(frozen=True, eq=False)
class Series:
    """A curve: (n,) environment steps, increasing, and (n,) values, nan where they were not finite."""

    steps: NDArray[np.int64]
    values: NDArray[np.float64]

    def part(self, start: float, end: float) -> NDArray[np.float64]:
        """The finite values whose step is in [start, end]."""
        values = self.values[(self.steps >= start) & (self.steps <= end)]
        return values[np.isfinite(values)]


@dataclass(frozen=True, eq=False)
class History:
    """What a run has told so far.

    Attributes:
        training: what it trains.
        series: its curves by name.
    """

    training: TrainingConfig
    series: Mapping[str, Series]

    @property
    def step(self) -> int:
        """Environment steps so far."""
        return max((int(series.steps[-1]) for series in self.series.values() if len(series.steps)), default=0)

    @property
    def progress(self) -> float:
        """Part of the configured steps that is done; the last update may have gone beyond them."""
        return min(1.0, self.step / self.training.steps)

    def recent(self, name: str) -> float | None:
        """Median of the curve over the last quarter of what was trained; None where that is too little."""
        values = self.between(name, 1.0 - _RECENT, 1.0)
        return float(np.median(values)) if len(values) >= MIN_POINTS else None

    def between(self, name: str, start: float, end: float) -> NDArray[np.float64]:
        """The finite values between two parts, 0 to 1, of what was trained so far."""
        series = self.series.get(name)
        return np.empty(0) if series is None else series.part(start * self.step, end * self.step)

    @property
    def success(self) -> float:
        """How often the robot arrives now: the newest evaluation, or recent training attempts; 0 where nothing is known."""
        evaluations = self.between("eval/success_rate", 0.0, 1.0)
        return max(
            float(evaluations[-1]) if len(evaluations) else 0.0,
            self.recent("train/success_rate") or 0.0,
        )
