"""A campaign's rows and runs as JSON shows them, beside the paper's."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

from server.database import tables
from server.experiments.repository import UNFINISHED, aggregate_state
from server.experiments.stored import training_of
from server.metrics.points import Points
from server.reproduction.schemas import (
    Campaign,
    CampaignRow,
    CampaignRun,
    CampaignSummary,
    PaperFigure,
    PaperTable,
    Reproduction,
)
from workers.config import TrainingConfig
from workers.reproduction.pace import Share, seconds_left
from workers.reproduction.results import Results, RowSpread, SeedResult, learned_at, row_spread
from workers.reproduction.rows import CURVE, FIGURES, ROW_BY_ID, ROWS, TABLES, Row
from workers.reproduction.verdict import Verdict, judge_all
from workers.reproduction.widths import seeds_wanted
from workers.statistics.differences import LEAST_SEEDS
from workers.training.table import TableRow

Latest = Mapping[str, Mapping[str, float]]
"""The newest value of each metric, by run and name."""


def reproduction_view(
    experiments: Sequence[tables.Experiment],
    latest: Latest,
    evaluations: Mapping[str, Points],
    campaign: Campaign | None,
    campaigns: Sequence[CampaignSummary],
    workers: int,
) -> Reproduction:
    """The paper and a campaign, side by side.

    Args:
        experiments: of the campaign.
        latest: what its runs have reported of their drives.
        evaluations: success rates on the frozen suite, by run, of those that are done.
        campaign: how it stands; None before the first.
        campaigns: all of them.
        workers: that are here.
    """
    by_row = {experiment.campaign_row: experiment for experiment in experiments}
    trainings = {row: training_of(experiment) for row, experiment in by_row.items()}
    results = results_of(experiments, latest, evaluations)
    return Reproduction(
        campaign=campaign,
        campaigns=list(campaigns),
        workers=workers,
        seconds=expected_seconds(max(1, workers)),
        curve=CURVE,
        tables=[
            PaperTable(id=table.id, title=table.title, rows=list(table.rows), labels=list(table.labels)) for table in TABLES
        ],
        figures=[PaperFigure(id=figure.id, title=figure.title, rows=list(figure.rows)) for figure in FIGURES],
        rows=[
            _row_view(row, by_row.get(row.id), trainings.get(row.id, row.training), latest, results[row.id]) for row in ROWS
        ],
        claims=list(_judged(_frozen(results))),
        wanted=wanted_seeds(experiments, results),
    )


def results_of(experiments: Sequence[tables.Experiment], latest: Latest, evaluations: Mapping[str, Points]) -> Results:
    """What the campaign's runs that are done have measured, by row; see `reproduction_view`."""
    by_row = {experiment.campaign_row: experiment for experiment in experiments}
    return {row.id: _results(by_row.get(row.id), latest, evaluations) for row in ROWS}


def wanted_seeds(experiments: Sequence[tables.Experiment], results: Results) -> dict[str, int]:
    """How many seeds rows should have whose intervals are too wide; none is said of a trial, or before all runs are done."""
    if any(run.state != "completed" for experiment in experiments for run in experiment.runs):
        return {}
    if any(_effort(experiment, training_of(experiment)) < 1.0 for experiment in experiments):
        return {}
    trained = {experiment.campaign_row: len(experiment.runs) for experiment in experiments}
    return _wanted(_frozen(results), tuple((row, count) for row, count in trained.items() if row in ROW_BY_ID))


_FrozenResults = tuple[tuple[str, tuple[SeedResult, ...]], ...]


def _frozen(results: Results) -> _FrozenResults:
    return tuple((row, tuple(seeds)) for row, seeds in results.items())


@lru_cache(maxsize=8)
def _wanted(results: _FrozenResults, trained: tuple[tuple[str, int], ...]) -> dict[str, int]:
    return seeds_wanted(dict(results), dict(trained))


@lru_cache(maxsize=8)
def _judged(results: _FrozenResults) -> tuple[Verdict, ...]:
    """The claims; intervals take a second, and what is done stays as it is."""
    return judge_all(dict(results))


@lru_cache(maxsize=128)
def _spread_of(seeds: tuple[SeedResult, ...]) -> RowSpread | None:
    """A row's figures over its seeds, likewise."""
    return row_spread(seeds)


def expected_seconds(workers: int) -> float:
    """That a campaign with as many seeds as claims need takes with so many workers, about."""
    shares = [Share(expected=row.seconds, done=0.0) for row in ROWS for _ in range(LEAST_SEEDS)]
    return seconds_left(shares, workers)


def campaign_view(campaign_id: str, experiments: Sequence[tables.Experiment], workers: int, now: float) -> Campaign:
    """How a campaign stands.

    Args:
        campaign_id: its id.
        experiments: of it, at least one.
        workers: that are here.
        now: seconds since the epoch.
    """
    shares = [share for experiment in experiments for share in _shares(experiment, now)]
    runs = [run for experiment in experiments for run in experiment.runs]
    # What was stopped or has failed takes no more time.
    going_on = [
        share.model_copy(update={"expected": share.expected * share.done, "done": 1.0}) if run.state in _ENDED else share
        for run, share in zip(runs, shares, strict=True)
    ]
    active = any(run.state in UNFINISHED for run in runs)
    return Campaign(
        id=campaign_id,
        created_at=experiments[0].created_at,
        state=aggregate_state([run.state for run in runs]),
        seeds=max(len(experiment.runs) for experiment in experiments),
        effort=_effort(experiments[0], training_of(experiments[0])),
        progress=sum(share.expected * share.done for share in shares) / sum(share.expected for share in shares),
        seconds_left=seconds_left(going_on, workers) if active and workers else None,
    )


_ENDED = frozenset({"stopped", "failed", "stopping"})


def _shares(experiment: tables.Experiment, now: float) -> list[Share]:
    training = training_of(experiment)
    row = _row(experiment)
    expected = (row.seconds if row else 1.0) * _effort(experiment, training)
    return [Share(expected=expected, done=_progress(run, training), spent=_spent(run, now)) for run in experiment.runs]


def _spent(run: tables.Run, now: float) -> float | None:
    """Seconds; None where they can't be told: a run that was taken up more than once has waited in between."""
    if run.started_at is None or run.attempt != 1 or run.state not in ("running", "completed"):
        return None
    return max(0.0, (run.finished_at or now) - run.started_at)


def _row(experiment: tables.Experiment) -> Row | None:
    """The row that it trains; None where a later version has dropped it."""
    return ROW_BY_ID.get(experiment.campaign_row or "")


def _effort(experiment: tables.Experiment, training: TrainingConfig) -> float:
    row = _row(experiment)
    return training.steps / row.training.steps if row else 1.0


def _progress(run: tables.Run, training: TrainingConfig) -> float:
    return 1.0 if run.state == "completed" else min(1.0, run.step / training.steps)


def _results(experiment: tables.Experiment | None, latest: Latest, evaluations: Mapping[str, Points]) -> list[SeedResult]:
    if experiment is None:
        return []
    training = training_of(experiment)
    results = []
    for run in experiment.runs:
        measured = _measured(run, latest)
        if measured is None:
            continue
        points = evaluations.get(run.id, Points.joined([]))
        learned = learned_at(points.steps.tolist(), points.values.tolist())
        results.append(SeedResult(seed=run.seed, steps=training.steps, measured=measured, learned_at=learned))
    return results


def _measured(run: tables.Run, latest: Latest) -> TableRow | None:
    return TableRow.from_metrics(latest.get(run.id, {})) if run.state == "completed" else None


def _row_view(
    row: Row,
    experiment: tables.Experiment | None,
    training: TrainingConfig,
    latest: Latest,
    results: Sequence[SeedResult],
) -> CampaignRow:
    return CampaignRow(
        id=row.id,
        method=row.method,
        instead_of=row.instead_of,
        paper=row.paper,
        ours=_spread_of(tuple(results)),
        experiment_id=experiment.id if experiment else None,
        runs=[
            CampaignRun(
                id=run.id,
                seed=run.seed,
                state=run.state,
                progress=_progress(run, training),
                error=run.error,
                measured=_measured(run, latest),
            )
            for run in (experiment.runs if experiment else ())
        ],
    )
