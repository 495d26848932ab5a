"""Experiments side by side: final figures, differences, and curves on a common grid."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from server import statistics
from server.abandoned import stop_if_abandoned
from server.checkpoints.repository import CheckpointRepository, decode_episodes
from server.checkpoints.views import estimate
from server.comparison.differences import differences
from server.comparison.schemas import ComparedExperiment, Comparison, Curves, ExperimentCurves, SeedCurve
from server.database import tables
from server.experiments.repository import ExperimentRepository
from server.metrics.points import Points
from server.metrics.repository import MetricRepository
from server.metrics.service import json_numbers
from server.schemas import Estimate
from server.services import Services

# Below this, a bootstrap interval over seeds is far too narrow: one that says 95 % over 3 seeds covers 45 %.
_ENOUGH_SEEDS = 5


class ComparisonService:
    """Compares experiments."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def compare(self, experiment_ids: Sequence[str]) -> Comparison:
        """Final figures and differences, in the order asked for.

        Raises:
            NotFoundError: one of the experiments is missing.
        """
        with self._services.database.read() as session:
            experiments = ExperimentRepository(session).get_many(experiment_ids)
            compared = [_final_figures(session, experiment) for experiment in experiments]
            warnings = _warnings(session, experiments, compared)
        settings = [experiment.training for experiment in experiments]
        return Comparison(experiments=compared, differences=differences(settings), warnings=warnings)

    def curves(self, experiment_ids: Sequence[str], name: str, points: int) -> Curves:
        """One metric of all runs on one grid of at most `points` steps.

        Raises:
            NotFoundError: one of the experiments is missing.
        """
        with self._services.database.read() as session:
            experiments = ExperimentRepository(session).get_many(experiment_ids)
            repository = MetricRepository(session)
            series = {run.id: _series(repository, run.id, name) for experiment in experiments for run in experiment.runs}
        grid = common_grid(list(series.values()), points)
        return Curves(
            name=name,
            steps=grid.tolist(),
            experiments=[_curves(experiment, series, grid) for experiment in experiments],
        )


def _series(repository: MetricRepository, run_id: str, name: str) -> Points:
    stop_if_abandoned()
    return repository.read(run_id, [name]).get(name, Points.joined([]))


def common_grid(series: Sequence[Points], limit: int) -> NDArray[np.int64]:
    """The steps of all series together or, where those are more than `limit`, as many evenly spaced over their range."""
    steps = np.unique(np.concatenate([points.steps for points in series])) if series else np.zeros(0, np.int64)
    if steps.size <= limit:
        return steps
    return np.unique(np.linspace(steps[0], steps[-1], limit).round().astype(np.int64))


def resample(points: Points, grid: NDArray[np.int64]) -> NDArray[np.float64]:
    """The series at the grid's steps, linear in between; nan before its first finite point and after its last."""
    finite = np.isfinite(points.values)
    if not finite.any():
        return np.full(grid.size, np.nan)
    return np.interp(grid, points.steps[finite], points.values[finite].astype(np.float64), left=np.nan, right=np.nan)


def _curves(experiment: tables.Experiment, series: dict[str, Points], grid: NDArray[np.int64]) -> ExperimentCurves:
    values = np.array([resample(series[run.id], grid) for run in experiment.runs]).reshape(len(experiment.runs), grid.size)
    present = np.isfinite(values)
    count = present.sum(axis=0)
    mean = np.full(grid.size, np.nan)
    for index in np.flatnonzero(count):
        mean[index] = values[present[:, index], index].mean()
    low, high = statistics.curve_band(values)
    return ExperimentCurves(
        id=experiment.id,
        name=experiment.name,
        seeds=[SeedCurve(seed=run.seed, values=json_numbers(row)) for run, row in zip(experiment.runs, values, strict=True)],
        mean=json_numbers(mean),
        low=json_numbers(low),
        high=json_numbers(high),
        count=count.tolist(),
    )


def _final_figures(session: Session, experiment: tables.Experiment) -> ComparedExperiment:
    evaluations = _alike(CheckpointRepository(session).final_evaluations([run.id for run in experiment.runs]))
    if not evaluations:
        return ComparedExperiment(
            id=experiment.id,
            name=experiment.name,
            seeds=0,
            episodes=0,
            suite=None,
            suite_hash=None,
            success=None,
            steps_per_target=None,
            reward=None,
        )
    tables = [decode_episodes(evaluation) for evaluation in evaluations]
    counts = [len(table) for table in tables]
    success = statistics.success_rate([evaluation.arrivals for evaluation in evaluations], counts)
    arrived = [[episode for episode in table if episode.outcome == "arrival"] for table in tables]
    return ComparedExperiment(
        id=experiment.id,
        name=experiment.name,
        seeds=len(tables),
        episodes=sum(counts),
        suite=evaluations[0].suite,
        suite_hash=evaluations[0].suite_hash,
        success=estimate(success, seeds=len(tables), episodes=sum(counts)),
        steps_per_target=_over_seeds([np.array([float(e.steps) for e in table]) for table in arrived]),
        reward=_over_seeds([np.array([e.reward for e in table]) for table in tables]),
    )


def _over_seeds(samples: list[NDArray[np.float64]]) -> Estimate | None:
    """The estimate over the seeds that have any episode to show."""
    samples = [values for values in samples if values.size]
    if not samples:
        return None
    return estimate(statistics.seeds_estimate(samples), seeds=len(samples), episodes=sum(values.size for values in samples))


def _alike(final: dict[str, tables.Evaluation]) -> list[tables.Evaluation]:
    """Those on the suite that most of the runs were measured on: others can't be counted together with them."""
    if not final:
        return []
    (suite_hash, _), *_ = Counter(evaluation.suite_hash for evaluation in final.values()).most_common(1)
    return [evaluation for evaluation in final.values() if evaluation.suite_hash == suite_hash]


def _warnings(
    session: Session, experiments: Sequence[tables.Experiment], compared: Sequence[ComparedExperiment]
) -> list[str]:
    warnings = []
    for experiment, figures in zip(experiments, compared, strict=True):
        if figures.seeds == 0:
            warnings.append(f"{experiment.name} has not been evaluated yet.")
            continue
        if figures.seeds < _ENOUGH_SEEDS:
            plural = "seed" if figures.seeds == 1 else "seeds"
            warnings.append(
                f"{experiment.name} has {figures.seeds} {plural}: fewer than {_ENOUGH_SEEDS} can't show that one "
                "configuration beats another, and its intervals are too narrow."
            )
        missing = len(experiment.runs) - figures.seeds
        if missing:
            warnings.append(f"{missing} of {len(experiment.runs)} runs of {experiment.name} are not in its figures.")
        if any(run.state in ("queued", "running", "stopping") for run in experiment.runs):
            warnings.append(f"{experiment.name} is not finished: its figures are those of its newest checkpoints.")
    if len({figures.suite_hash for figures in compared if figures.suite_hash}) > 1:
        warnings.append("They were measured on different suites: their figures can't be compared.")
    return warnings
