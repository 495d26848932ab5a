"""Studies' rows as JSON shows them."""

from collections.abc import Mapping, Sequence
from typing import Any

from server.checkpoints.views import success_over_runs
from server.database import tables
from server.experiments.repository import aggregate_state
from server.experiments.stored import read_training
from server.studies.advance import best_of
from server.studies.importance_intervals import LEAST_FOR_INTERVALS, RESAMPLES
from server.studies.rules import RULE, rungs_of
from server.studies.schemas import ImportanceIntervals, Judgement, ListedStudy, Span, Study, StudySpec, Trial

_THROUGH = ("complete", "pruned", "failed")


def listed_view(study: tables.Study, counts: Mapping[str, int], best_success: float | None) -> ListedStudy:
    """A study as a list shows it."""
    return ListedStudy(
        id=study.id,
        project_id=study.project_id,
        name=study.name,
        created_at=study.created_at,
        finished_at=study.finished_at,
        state=study.state,
        sampler=study.spec["sampler"],
        trials=study.budget,
        asked=study.asked,
        complete=counts.get("complete", 0),
        pruned=counts.get("pruned", 0),
        failed=counts.get("failed", 0),
        best_success=best_success,
    )


def study_view(
    study: tables.Study,
    trials: Sequence[tables.StudyTrial],
    experiments: Mapping[str, tables.Experiment],
    finals: Mapping[str, tables.Evaluation],
) -> Study:
    """A study with its trials.

    Args:
        study: its row.
        trials: by number.
        experiments: of trials that go on, and the judgement's, where they are there.
        finals: the last evaluation of each of the judgement's runs.
    """
    # Another version's settings are shown as far as they can be read.
    spec = StudySpec.model_validate(study.spec | {"training": read_training(study.spec["training"]).training})
    every = spec.training.evaluation.every_steps
    results = [_trial_view(trial, experiments.get(trial.experiment_id or ""), every) for trial in trials]
    counts = {state: sum(trial.state == state for trial in trials) for state in _THROUGH}
    best = best_of(trials)
    listed = listed_view(study, counts, best.success if best else None)
    judgement = experiments.get(study.judgement_id or "")
    return Study(
        **listed.model_dump(),
        spec=spec,
        rule=RULE if spec.stop_early else None,
        progress=sum(trial.progress for trial in results) / study.budget,
        seconds_left=_seconds_left(study, trials, results, spec.at_once),
        results=results,
        best=best.number + 1 if best else None,
        front=front(trials),
        importances=study.importances,
        importance_intervals=_importance_intervals(study.importance_intervals),
        judgement=_judgement(study, judgement, finals) if judgement else None,
    )


def front(trials: Sequence[tables.StudyTrial]) -> list[int]:
    """Numbers, from 1, of the complete trials that no other one beats in both cost and success, by cost."""
    complete = [trial for trial in trials if trial.state == "complete" and trial.cost is not None]
    found: list[int] = []
    highest = -1.0
    for trial in sorted(complete, key=lambda trial: (trial.cost or 0.0, -(trial.success or 0.0))):
        if (trial.success or 0.0) > highest:
            highest = trial.success or 0.0
            found.append(trial.number + 1)
    return found


def _trial_view(trial: tables.StudyTrial, experiment: tables.Experiment | None, every: int) -> Trial:
    progress = 1.0 if trial.state in _THROUGH else 0.0
    if trial.state not in _THROUGH and experiment is not None and experiment.runs:
        total = experiment.training["steps"] * len(experiment.runs)
        progress = min(1.0, sum(run.step for run in experiment.runs) / total)
    return Trial(
        number=trial.number + 1,
        state=trial.state,
        values=trial.values,
        experiment_id=trial.experiment_id,
        progress=progress,
        success=trial.success,
        seconds_to_target=trial.seconds_to_target,
        cost=trial.cost,
        rungs={rung * every: rate for rung, rate in rungs_of(trial.rungs).items()},
        reason=trial.reason,
    )


def _seconds_left(
    study: tables.Study, trials: Sequence[tables.StudyTrial], results: Sequence[Trial], at_once: int
) -> float | None:
    """As the trials until now took on average, as many at a time as now."""
    took = [
        trial.finished_at - trial.created_at
        for trial in trials
        if trial.finished_at is not None and trial.state in ("complete", "pruned")
    ]
    if study.state != "running" or not took:
        return None
    left = study.budget - sum(trial.progress for trial in results)
    return left * sum(took) / len(took) / at_once


def _importance_intervals(found: Mapping[str, Any] | None) -> ImportanceIntervals | None:
    if found is None:
        return None
    trials = found["trials"]
    if found["spans"]:
        told = f"95 % intervals over trials, by {RESAMPLES} bootstrap samples of the {trials} complete ones."
    elif trials < LEAST_FOR_INTERVALS:
        told = (
            f"How sure that is can't be told from {trials} complete trials, of which the best tenth is one or two: "
            f"from {LEAST_FOR_INTERVALS} on there are intervals."
        )
    else:
        told = "How sure that is can't be told: its trials did alike, or this version can't read their settings."
    spans = {path: Span(low=low, high=high) for path, (low, high) in found["spans"].items()}
    return ImportanceIntervals(trials=trials, resamples=RESAMPLES, spans=spans, told=told)


def _judgement(study: tables.Study, experiment: tables.Experiment, finals: Mapping[str, tables.Evaluation]) -> Judgement:
    return Judgement(
        trial=(study.judged_trial or 0) + 1,
        experiment_id=experiment.id,
        seeds=[run.seed for run in experiment.runs],
        state=aggregate_state([run.state for run in experiment.runs]),
        success=success_over_runs([finals[run.id] for run in experiment.runs if run.id in finals]),
    )
