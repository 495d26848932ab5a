"""What can be told: something that happened, in words, under a key that is the same for the same thing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from server.database import tables
from server.database.tables import AlertEvent
from workers.diagnoses import Diagnosis
from workers.wording import counted, percent

_LONGEST_ERROR = 500

Findings = Callable[[], Sequence[Diagnosis]]
"""Reads curves for what is wrong, causes before symptoms."""


@dataclass(frozen=True, slots=True)
class Happening:
    """Something that happened.

    Attributes:
        event: what.
        key: the same for the same thing, within a rule.
        title: a line.
        words: makes sentences of it; may read curves.
        project_id: where; null where it is about the installation.
        experiment_id: of the training.
        run_id: of the run, where it is about one.
        at: since when it is so, in seconds since the epoch; None where it is so now.
    """

    event: AlertEvent
    key: str
    title: str
    words: Callable[[], str]
    project_id: str | None = None
    experiment_id: str | None = None
    run_id: str | None = None
    at: float | None = None


def ended(experiment: tables.Experiment, runs: Sequence[tables.Run], found: Findings) -> Happening:
    """All runs of a training have ended.

    Args:
        experiment: the training.
        runs: all of its runs.
        found: the diagnoses of the last that ended.
    """
    counts = [
        f"{number} {state}"
        for state in ("completed", "stopped", "failed")
        if (number := sum(run.state == state for run in runs))
    ]
    rates = [rate for run in runs if (rate := success_rate(run)) is not None]
    success = f" Success: {', '.join(percent(rate) for rate in rates)}." if rates else ""
    return Happening(
        event="ended",
        # A run that is resumed begins another attempt, and so ends once more.
        key=f"ended {experiment.id} {sum(run.attempt for run in runs)}",
        title=f"{experiment.name} has ended",
        words=lambda: (
            f"Of {len(runs)} {'run' if len(runs) == 1 else 'runs'}: {', '.join(counts)}.{success}{_what_curves_say(found())}"
        ),
        project_id=experiment.project_id,
        experiment_id=experiment.id,
        at=max((run.finished_at or 0.0 for run in runs), default=0.0),
    )


def failed(run: tables.Run, found: Findings) -> Happening:
    """A run has failed."""
    error = (run.error or "").strip()
    why = error if len(error) <= _LONGEST_ERROR else f"... {error[-_LONGEST_ERROR:]}"
    return Happening(
        event="failed",
        key=f"failed {run.id} {run.attempt}",
        title=f"{run.experiment.name}, seed {run.seed}, has failed",
        words=lambda: f"At step {counted(run.step)}: {why or 'nobody said why.'}{_what_curves_say(found())}",
        project_id=run.experiment.project_id,
        experiment_id=run.experiment_id,
        run_id=run.id,
        at=run.finished_at,
    )


def diagnosed(run: tables.Run, diagnosis: Diagnosis) -> Happening:
    """A run's curves say that something is wrong."""
    advice = f" To try first: {diagnosis.advice[0]}" if diagnosis.advice else ""
    return Happening(
        event="diagnosis",
        key=f"diagnosis {run.id} {diagnosis.id}",
        title=f"{run.experiment.name}, seed {run.seed}: {diagnosis.title}",
        words=lambda: f"{diagnosis.explanation}{advice}",
        project_id=run.experiment.project_id,
        experiment_id=run.experiment_id,
        run_id=run.id,
        at=run.finished_at,
    )


def succeeded(run: tables.Run, threshold: float) -> Happening:
    """A run's newest evaluation is above a threshold; it must have one."""
    rate = success_rate(run)
    assert rate is not None
    return Happening(
        event="success",
        key=f"success {run.id}",
        title=f"{run.experiment.name}, seed {run.seed}: success {percent(rate)}",
        words=lambda: (
            f"{run.final_arrivals} of {run.final_episodes} episodes on {run.final_suite} arrive at step "
            f"{counted(run.final_step or 0)}: at or above {percent(threshold)}."
        ),
        project_id=run.experiment.project_id,
        experiment_id=run.experiment_id,
        run_id=run.id,
        at=run.finished_at,
    )


def stuck(experiment: tables.Experiment, waiting: int, since: float, now: float) -> Happening:
    """Runs of a training have waited for too long; told once a day."""
    minutes = (now - since) / 60.0
    return Happening(
        event="stuck",
        key=f"stuck {experiment.id} {_day(now)}",
        title=f"{experiment.name} waits in the queue",
        words=lambda: (
            f"{waiting} {'run waits' if waiting == 1 else 'runs wait'}, for {counted(minutes)} minutes by now. The page of "
            "the queue says for what."
        ),
        project_id=experiment.project_id,
        experiment_id=experiment.id,
    )


def disk_low(free: int, now: float) -> Happening:
    """Little is left on the disk; told once a day."""
    return Happening(
        event="disk",
        key=f"disk {_day(now)}",
        title=f"{free / 2**30:,.1f} GiB are left on the server's disk",
        words=lambda: "Checkpoints will soon be refused. Delete trainings that nobody needs, and empty the trash.",
    )


def tried(event: AlertEvent, key: str) -> Happening:
    """What a rule says when somebody tries it."""
    return Happening(
        event=event,
        key=f"test {key}",
        title="A test of Mapless's alerts",
        words=lambda: "This is how this rule tells you; nothing has happened.",
    )


def success_rate(run: tables.Run) -> float | None:
    """Of the run's last evaluated checkpoint; None where there is none."""
    if run.final_arrivals is None or not run.final_episodes:
        return None
    return run.final_arrivals / run.final_episodes


def _what_curves_say(found: Sequence[Diagnosis]) -> str:
    if not found:
        return ""
    first = found[0]
    others = f" Also: {', '.join(each.title for each in found[1:])}." if len(found) > 1 else ""
    advice = f" To try first: {first.advice[0]}" if first.advice else ""
    return f" Its curves say: {first.title}. {first.explanation}{advice}{others}"


def _day(now: float) -> int:
    return int(now // 86_400)
