"""Curves of experiments on one grid: how fine they are read, what is beyond a known answer, runs taken together."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from server.comparison.following import Followed
from server.comparison.grid import Curve, Grid, all_under_way, resample
from server.comparison.schemas import ExperimentCurves, SeedCurve
from server.database import tables
from server.estimates import metric_band
from server.metrics.buckets import MAX_BUCKETS, SUMMARY_WIDTH, Buckets
from server.metrics.lines import cut_lines
from server.metrics.points import Points
from server.metrics.repository import MetricRepository
from server.metrics.service import json_rows
from server.metrics.thinning import EVALUATIONS


def _width(points: int) -> int:
    """How wide curves are at most that are looked at in so many places."""
    return MAX_BUCKETS if points <= SUMMARY_WIDTH else points


def finer(
    repository: MetricRepository, run_ids: Sequence[str], names: Sequence[str], points: int
) -> Mapping[str, Mapping[str, Buckets]]:
    """Series finer than a grid of so many places, by run and name: long ones as their summaries know them."""
    if points > SUMMARY_WIDTH:
        return repository.curves(run_ids, names, points)
    known = repository.lines(run_ids, names)
    return {run_id: cut_lines(lines, _width(points)) for run_id, lines in known.items()}


def beyond(tails: Mapping[str, Points], known: Followed, points: int) -> tuple[dict[str, Curve], Grid] | None:
    """The curves and the grid beyond what is known; None where that is too much to go on from it."""
    whole = {run_id: Curve.over_steps(Buckets.of(each)) for run_id, each in tails.items()}
    grid = known.beyond(list(whole.values()), points)
    if grid is None or grid.spacing == "points":
        return None if grid is None else (whole, grid)
    # As fine as what is known: its places lay on curves of so many buckets.
    width = 2 + -(-grid.x.size * _width(points) // points)
    cut = {run_id: Curve.over_steps(Buckets.of(each).cut(width + 2, each.steps[:1])) for run_id, each in tails.items()}
    return cut, grid


def curve_of(read: Mapping[str, Buckets], name: str, counter: str | None) -> Curve:
    """A run's curve of the metric; without points where the metric, or what counts its x, was never reported."""
    nothing = Buckets.of(Points.joined([]))
    points = read.get(name, nothing)
    return Curve.over_steps(points) if counter is None else Curve.over(points, read.get(counter, nothing))


@dataclass(frozen=True, slots=True, eq=False)
class _Together:
    """An experiment's runs on the grid.

    Attributes:
        values: (runs, n), each run's; nan where it has none.
        band: (3, n), their mean and its interval; nan where it is not told.
    """

    values: NDArray[np.float64]
    band: NDArray[np.float64]

    @classmethod
    def of(cls, curves: Sequence[Curve], grid: NDArray[np.float64], *, name: str, driven: Sequence[int]) -> "_Together":
        """Of the curves of its runs.

        Args:
            curves: of each run.
            grid: where they are looked at.
            name: of the metric.
            driven: episodes behind each value of each run; 0 where that is not known.
        """
        values = np.array([resample(curve, grid) for curve in curves]).reshape(len(curves), grid.size)
        episodes = np.array(driven, np.float64)[:, None]
        counted = episodes[np.isfinite(values).any(axis=1)].all()
        band = metric_band(name, values, episodes if counted else None)
        return cls(values, np.where(all_under_way(curves, values), np.stack(band), np.nan))


def experiment_curves(
    experiments: Sequence[tables.Experiment],
    series: Mapping[str, Curve],
    grid: NDArray[np.float64],
    name: str,
    episodes: Mapping[str, int],
    shown: int | None,
    unplaced: Collection[str],
) -> list[ExperimentCurves]:
    """The curves of experiments on a grid.

    Args:
        experiments: with their runs.
        series: the curve of each run.
        grid: the places, (n,).
        name: of the metric.
        episodes: behind the last evaluation of each run that has one.
        shown: runs of each experiment that are told one by one; None for all.
        unplaced: runs that have the metric, and no place on this x.
    """
    measured = name.startswith(EVALUATIONS)
    together = [
        _Together.of(
            [series[run.id] for run in experiment.runs],
            grid,
            name=name,
            driven=[episodes.get(run.id, 0) if measured else 0 for run in experiment.runs],
        )
        for experiment in experiments
    ]
    rows = iter(json_rows(np.concatenate([part for one in together for part in (one.band, one.values[:shown])])))
    return [
        ExperimentCurves(
            id=experiment.id,
            name=experiment.name,
            mean=next(rows),
            low=next(rows),
            high=next(rows),
            seeds=[
                SeedCurve(seed=run.seed, values=next(rows), thinned=run.thinned_at is not None and not measured)
                for run in experiment.runs[:shown]
            ],
            count=np.isfinite(one.values).sum(axis=0).tolist(),
            unplaced=sum(run.id in unplaced for run in experiment.runs),
        )
        for experiment, one in zip(experiments, together, strict=True)
    ]
