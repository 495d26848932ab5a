"""What has become of a trial, from its runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from server.database import tables
from server.database.tables import TrialState
from server.experiments.stored import training_of
from server.runs import states
from server.studies.proposals import Told
from server.studies.rules import hopeless, rungs_of, score
from server.studies.schemas import StudySpec
from workers.statistics.seeds import interquartile_mean


@dataclass(frozen=True)
class Verdict:
    """That a trial goes on no longer.

    Attributes:
        state: that it is in from now on.
        columns: of its row.
    """

    state: TrialState
    columns: Mapping[str, Any] = field(default_factory=dict)


def failed(reason: str) -> Verdict:
    """It has failed, which is not the same as success in no episode."""
    return Verdict("failed", {"reason": reason[:1_000]})


def ended(
    experiment: tables.Experiment | None, finals: Mapping[str, tables.Evaluation], suite_hash: str | None
) -> Verdict | None:
    """What its runs' ends make of a trial; None while they go on.

    Args:
        experiment: its training, None where it was deleted.
        finals: the last evaluation of each of its runs.
        suite_hash: that the study's other trials were measured on; None before the first.
    """
    if experiment is None:
        return failed("Its training was deleted.")
    for run in experiment.runs:
        if run.state == "failed":
            return failed(f"Seed {run.seed} failed: {run.error or 'for no reason that it told'}")
        if run.state == "stopped":
            return failed(f"Seed {run.seed} was stopped by hand.")
    if any(run.state not in states.FINISHED for run in experiment.runs):
        return None
    evaluations = [finals.get(run.id) for run in experiment.runs]
    measured = [evaluation for evaluation in evaluations if evaluation is not None]
    if len(measured) < len(evaluations):
        return failed("A run of it was never evaluated.")
    if {evaluation.suite_hash for evaluation in measured} != {suite_hash or measured[0].suite_hash}:
        return failed("It was measured on other scenarios than the trials before, and can't be held against them.")
    task = training_of(experiment).task
    success = interquartile_mean([evaluation.arrivals / evaluation.episode_count for evaluation in measured])
    steps = [evaluation.steps_mean for evaluation in measured if evaluation.steps_mean is not None]
    seconds = interquartile_mean(steps) * task.control_period if steps else None
    return Verdict(
        "complete",
        {
            "success": success,
            "seconds_to_target": seconds,
            "score": score(success, seconds, task.step_limit * task.control_period),
        },
    )


def rungs(
    experiment: tables.Experiment, evaluations: Mapping[str, Sequence[tuple[int, float]]], every: int
) -> dict[str, list[float | None]]:
    """Success rates by seed at every multiple of `every` steps: those of the first evaluation at it or after it."""
    found: dict[str, list[float | None]] = {}
    for run in experiment.runs:
        rates: list[float | None] = []
        for step, rate in evaluations.get(run.id, ()):
            rung = step // every
            if rung > len(rates):
                rates += [None] * (rung - 1 - len(rates)) + [rate]
        found[str(run.seed)] = rates
    return found


def unpromising(
    spec: StudySpec, now: Mapping[str, Sequence[float | None]], complete: Sequence[tables.StudyTrial]
) -> Verdict | None:
    """Whether a trial is stopped early; None while it goes on."""
    quarter = -(-spec.training.steps // (4 * spec.training.evaluation.every_steps))
    reason = hopeless(now, [trial.rungs for trial in complete], max(1, quarter)) if spec.stop_early else None
    return Verdict("pruned", {"reason": reason}) if reason else None


def cost(experiment: tables.Experiment | None, now: float) -> float | None:
    """Seconds that its runs were trained for, together; None where it is gone."""
    if experiment is None:
        return None
    return sum((run.finished_at or now) - run.started_at for run in experiment.runs if run.started_at is not None)


def told(trial: tables.StudyTrial) -> Told:
    """A trial as the sampler is told of it; a stopped one is taken up again, and so counts as going on."""
    outcome = "running" if trial.state == "stopped" else trial.state
    return Told(trial.values, outcome, trial.score, rungs_of(trial.rungs) if outcome == "pruned" else {})
