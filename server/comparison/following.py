"""A comparison's curves while runs report: which of them is known for good, so that only what is beyond need be sent.

Up to where every run that goes on has got, a place of the grid keeps its values: what is told of it changes only where a run
begins, is cut back or thinned, or where another set of seeds is through (`grid.all_under_way`). All of that is in a digest.
"""

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from server.comparison.grid import Curve, Grid
from server.database import tables
from server.experiments.repository import UNFINISHED

_TOKEN = re.compile(r"([0-9a-f]{16})\.(\d{1,18})\.(\d{1,18})")


@dataclass(frozen=True, slots=True)
class Followed:
    """What somebody knows of a comparison's curves.

    Attributes:
        digest: of what they were made of but for the points beyond.
        settled: the last place of the grid that they know for good, in steps.
        apart: steps between two places of an even grid; 0 where it lies on the points themselves.
    """

    digest: str
    settled: int
    apart: int

    @classmethod
    def of(cls, token: str) -> "Followed | None":
        """As it stands in an address; None where it is no such thing."""
        match = _TOKEN.fullmatch(token)
        return None if match is None else cls(match[1], int(match[2]), int(match[3]))

    @property
    def token(self) -> str:
        """For an address."""
        return f"{self.digest}.{self.settled}.{self.apart}"

    def beyond(self, curves: Sequence[Curve], limit: int) -> Grid | None:
        """The places that go on from the grid that is known; None where they are more than `limit`.

        Args:
            curves: of all runs, from `settled` on.
            limit: of the places.
        """
        last = max((curve.last_step for curve in curves), default=-1)
        if self.apart == 0:
            points = [curve.x[curve.x > self.settled] for curve in curves]
            x = np.unique(np.concatenate([np.zeros(0), *points]))
            return Grid(x, "points") if x.size <= limit else None
        if (last - self.settled) // self.apart >= limit:
            return None
        x = np.arange(self.settled + self.apart, last, self.apart, dtype=np.float64)
        # The newest point is shown wherever it lies.
        return Grid(np.append(x, float(last)) if last > self.settled else x, "even")


def digest_of(
    experiments: Sequence[tables.Experiment],
    series: Mapping[str, Curve],
    began: Mapping[str, int],
    episodes: Mapping[str, int],
    asked: tuple[object, ...],
) -> str:
    """Of what makes a known place another one.

    Args:
        experiments: that are compared.
        series: the curve of each run.
        began: the first step of each curve, by run.
        episodes: behind the last evaluation of each run.
        asked: which curves.
    """
    made_of: list[object] = [asked]
    for experiment in experiments:
        curves = {run.id: series[run.id] for run in experiment.runs}
        last = max((curve.last_step for curve in curves.values()), default=-1)
        through = [began[run_id] for run_id, curve in curves.items() if curve.last_step == last and run_id in began]
        runs = [(run.id, run.attempt, run.thinned_at, run.id in began, episodes.get(run.id)) for run in experiment.runs]
        made_of.append((experiment.id, experiment.name, max(through, default=None), runs))
    return hashlib.sha256(repr(made_of).encode()).hexdigest()[:16]


def settled_of(
    experiments: Sequence[tables.Experiment], series: Mapping[str, Curve], grid: Grid, known: Followed | None
) -> tuple[int, int] | None:
    """The last place of a grid that is known for good, and how far apart places are; None where there is no such place.

    Args:
        experiments: that are compared.
        series: the curve of each run.
        grid: that was answered.
        known: what it goes on from; None for a whole grid.
    """
    going_on = [
        series[run.id].last_step
        for experiment in experiments
        for run in experiment.runs
        if run.state in UNFINISHED and series[run.id].last_step >= 0
    ]
    even = grid.spacing == "even"
    # The last place of an even grid is where the newest point is, wherever that lies.
    places: NDArray[np.float64] = grid.x[:-1] if even and known is not None else grid.x
    reached = places[places <= min(going_on)] if going_on else places
    if known is not None:
        return (int(reached[-1]) if reached.size else known.settled), known.apart
    if not reached.size:
        return None
    apart = max(1, round((grid.x[-1] - grid.x[0]) / (grid.x.size - 1))) if even else 0
    return int(reached[-1]), apart
