"""Experiments side by side: final figures, differences, and curves on a common grid."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from server.comparison.compared import MADE_OF, Compared, read_compared
from server.comparison.curves import beyond, curve_of, experiment_curves, finer
from server.comparison.differences import differences
from server.comparison.figures import FinalFigures
from server.comparison.following import Followed, digest_of, settled_of
from server.comparison.grid import COUNTED_BY, Across, common_grid
from server.comparison.schemas import (
    Comparison,
    Curves,
    Profile,
    Profiles,
    ReportedMetric,
    ReportedMetrics,
)
from server.comparison.verdicts import improvements, verdicts
from server.database import tables
from server.errors import InvalidRequestError
from server.metrics.repository import MetricRepository
from server.metrics.service import json_numbers
from server.services import Services
from workers.statistics.differences import LEAST_SEEDS
from workers.statistics.improvement import performance_profile

MOST_IN_PAIRS = 12
"""Experiments whose every pair is judged: 66 pairs."""

MOST_METRICS = 500
"""Names of metrics that are told."""

_THRESHOLDS = np.linspace(0.0, 1.0, 51)


class ComparisonService:
    """Compares experiments."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def _compared(self, experiment_ids: Sequence[str]) -> Compared:
        # Read before the tables are: what is written meanwhile counts as new.
        written = self._services.database.writes.of(*MADE_OF)
        return self._services.compared.get(
            (tuple(experiment_ids), written), lambda: read_compared(self._services.database, experiment_ids)
        )

    def state(self, experiment_ids: Sequence[str]) -> str:
        """What a comparison of these experiments depends on, beside what is asked of it.

        Raises:
            NotFoundError: one of the experiments is missing.
        """
        return self._compared(experiment_ids).state

    def compare(
        self, experiment_ids: Sequence[str], margin: float, base: str | None = None, *, every_pair: bool = False
    ) -> Comparison:
        """Final figures, verdicts and differences, in the order asked for.

        Args:
            experiment_ids: of those to compare.
            margin: success rates that differ by less are equivalent, 0 to 1.
            base: what the others are held against; without it the first that has seeds enough, or the first of all.
            every_pair: hold each against all before it instead.

        Raises:
            NotFoundError: one of the experiments is missing.
            InvalidRequestError: the base is none of them, or there are too many for every pair.
        """
        _check_held(experiment_ids, base, every_pair=every_pair)
        compared = self._compared(experiment_ids)
        figures = compared.figures
        held_against = None if every_pair else base or _usual_base(figures)
        held = _held(experiment_ids, held_against)
        by_id = {one.id: one for one in figures}
        pairs = [(by_id[one], by_id[other]) for one, other in held]
        told = verdicts(pairs, margin)
        return Comparison(
            experiments=[one.view() for one in figures],
            base=held_against,
            verdicts=told,
            comparisons=sum(verdict.word != "refused" for verdict in told),
            improvements=improvements(pairs),
            differences=differences([experiment.training for experiment in compared.experiments]),
            warnings=_warnings(compared.experiments, figures),
        )

    def profiles(self, experiment_ids: Sequence[str]) -> Profiles:
        """How many attempts reach each score, of every experiment.

        Raises:
            NotFoundError: one of the experiments is missing.
        """
        figures = self._compared(experiment_ids).figures
        return Profiles(thresholds=_THRESHOLDS.tolist(), experiments=[_profile(one) for one in figures])

    def metrics(self, experiment_ids: Sequence[str]) -> ReportedMetrics:
        """What the runs of experiments have reported.

        Raises:
            NotFoundError: one of the experiments is missing.
        """
        runs = self._compared(experiment_ids).run_ids
        with self._services.database.read() as session:
            names = MetricRepository(session).names(runs, MOST_METRICS)
        return ReportedMetrics(runs=len(runs), metrics=[ReportedMetric(name=name, runs=count) for name, count in names])

    def curves(
        self,
        experiment_ids: Sequence[str],
        name: str,
        points: int,
        lines: int | None = None,
        across: Across = "steps",
        *,
        logarithmic: bool = False,
        since: str | None = None,
    ) -> Curves:
        """One metric of all runs on one grid of at most `points` places, or what has come of it since another answer.

        Args:
            experiment_ids: what is compared, in order.
            name: of the metric.
            points: of the grid at most.
            lines: single seeds at most, of all experiments together; None for all. Means and intervals are over all of them.
            across: what x is.
            logarithmic: whether x is shown on a logarithmic axis.
            since: `follow` of that other answer, to the same question; None for all.

        Raises:
            NotFoundError: one of the experiments is missing.
        """
        counter = COUNTED_BY.get(across)
        followable = counter is None and not logarithmic
        known = Followed.of(since) if since is not None and followable else None
        compared = self._compared(experiment_ids)
        experiments, run_ids, episodes = compared.experiments, compared.run_ids, compared.episodes
        shown = None if lines is None else lines // len(experiments)
        asked = (name, points, lines)
        # What a run reports meanwhile is told as of the moment before, and anew once its row is read again.
        with self._services.database.read() as session:
            repository = MetricRepository(session)
            if known is not None:
                tails, began = repository.tails(run_ids, name, known.settled)
                news = beyond(tails, known, points)
                if news is not None:
                    series, grid = news
                    digest = digest_of(experiments, series, began, episodes, asked)
                    if digest == known.digest:
                        settled = settled_of(experiments, series, grid, known)
                        return Curves(
                            name=name,
                            across=across,
                            spacing=grid.spacing,
                            steps=grid.x.astype(np.int64).tolist(),
                            experiments=experiment_curves(experiments, series, grid.x, name, episodes, shown, ()),
                            since=known.settled,
                            follow=None if settled is None else Followed(digest, *settled).token,
                        )
            wanted = [name] if counter is None else [name, counter]
            read = finer(repository, run_ids, wanted, points)
            chunks_began = repository.began(run_ids, name) if followable else {}
        series = {run_id: curve_of(read[run_id], name, counter) for run_id in run_ids}
        grid = common_grid(list(series.values()), points, whole=across == "steps", logarithmic=logarithmic)
        unplaced = {run_id for run_id in run_ids if name in read[run_id] and not series[run_id].x.size}
        settled = settled_of(experiments, series, grid, None) if followable else None
        began = {run_id: int(curve.x[0]) for run_id, curve in series.items() if curve.x.size} | chunks_began
        digest = digest_of(experiments, series, began, episodes, asked)
        return Curves(
            name=name,
            across=across,
            spacing=grid.spacing,
            steps=grid.x.astype(np.int64).tolist() if counter is None else [],
            x=None if counter is None else [float(f"{x:.7g}") for x in grid.x],
            experiments=experiment_curves(experiments, series, grid.x, name, episodes, shown, unplaced),
            follow=None if settled is None else Followed(digest, *settled).token,
        )


def _check_held(experiment_ids: Sequence[str], base: str | None, *, every_pair: bool) -> None:
    if base is not None and base not in experiment_ids:
        raise InvalidRequestError("The base is none of the experiments that are compared.")
    if every_pair and len(experiment_ids) > MOST_IN_PAIRS:
        raise InvalidRequestError(f"Every pair is judged of {MOST_IN_PAIRS} experiments at most: choose a base.")


def _usual_base(figures: Sequence[FinalFigures]) -> str:
    """Against what has just begun nothing could be said."""
    return next((one.id for one in figures if one.seeds >= LEAST_SEEDS), figures[0].id)


def _held(experiment_ids: Sequence[str], base: str | None) -> list[tuple[str, str]]:
    """What is held against what: pairs of the base and another; every pair without a base."""
    if base is None:
        return list(combinations(experiment_ids, 2))
    return [(base, other) for other in experiment_ids if other != base]


def _profile(figures: FinalFigures) -> Profile:
    if not figures.driven:
        return Profile(id=figures.id, name=figures.name, seeds=0, mean=[], low=[], high=[])
    mean, low, high = performance_profile([seed.score for seed in figures.driven], _THRESHOLDS)
    return Profile(
        id=figures.id,
        name=figures.name,
        seeds=figures.seeds,
        mean=json_numbers(mean),
        low=json_numbers(low),
        high=json_numbers(high),
    )


def _warnings(experiments: Sequence[tables.Experiment], compared: Sequence[FinalFigures]) -> list[str]:
    warnings = []
    for experiment, figures in zip(experiments, compared, strict=True):
        thinned = sum(run.thinned_at is not None for run in experiment.runs)
        if thinned:
            warnings.append(
                f"Curves of {thinned} of {len(experiment.runs)} runs of {experiment.name} were thinned to means of "
                "neighbouring points. Its figures are not touched by that."
            )
        if figures.seeds == 0:
            warnings.append(f"{experiment.name} has not been evaluated yet.")
            continue
        missing = len(experiment.runs) - figures.seeds
        if missing:
            warnings.append(f"{missing} of {len(experiment.runs)} runs of {experiment.name} are not in its figures.")
        if any(run.state in ("queued", "running", "stopping") for run in experiment.runs):
            warnings.append(f"{experiment.name} is not finished: its figures are those of its newest checkpoints.")
    if len({figures.suite_hash for figures in compared if figures.suite_hash}) > 1:
        warnings.append("They were measured on different suites: their figures can't be compared.")
    return warnings
