"""How an attempt begins and ends, as changes to a run's row within the caller's transaction.

The attempt's number is the fencing token: `unfenced` refuses every older one, so whatever a worker says after it has lost
its run changes nothing.
"""

import time

from sqlalchemy.orm import Session

from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.errors import ConflictError, NotFoundError
from server.metrics.repository import MetricRepository
from server.runs import states
from server.runs.repository import RunRepository
from workers.protocol import Final

# Attempts in a row that may be lost without a new checkpoint before the run fails.
MAX_LOSSES = 3


class FencedError(ConflictError):
    """The attempt is over: a newer one runs, its lease ran out, or the run has ended or was deleted."""


def begin(session: Session, run: tables.Run, worker: str, published_attempt: int) -> tables.Checkpoint | None:
    """Give the run to a worker; what was reported beyond its last checkpoint is dropped.

    Returns:
        The checkpoint to go on from; None for a fresh start.

    Raises:
        ConflictError: the run does not wait for a worker at this attempt (any more).
    """
    if run.state != "queued" or run.attempt != published_attempt:
        raise ConflictError(
            f"Run {run.id} is {run.state} at attempt {run.attempt}: it is not to be had at {published_attempt}."
        )
    now = time.time()
    checkpoint = CheckpointRepository(session).last(run.id)
    run.state = states.next_state(run.state, "claim")
    run.attempt += 1
    run.worker = worker
    run.started_at = run.started_at or now
    run.step = checkpoint.step if checkpoint else 0
    # A step of its own for a fresh start: points at step 0 go too.
    MetricRepository(session).drop_beyond(run.id, checkpoint.step if checkpoint else -1)
    origin = f"from step {checkpoint.step:,}" if checkpoint else "from the start"
    RunRepository(session).add_event(run.id, "info", f"Attempt {run.attempt} begins {origin} on {worker}.", run.step)
    return checkpoint


def unfenced(run: tables.Run | None, run_id: str, attempt: int) -> tables.Run:
    """The run, if it is this attempt's.

    Raises:
        FencedError: the attempt is over, or the run was deleted.
    """
    if run is None:
        raise FencedError(NotFoundError.of("run", run_id).message)
    if run.attempt != attempt or run.state not in states.ACTIVE:
        raise FencedError(f"Attempt {attempt} of run {run.id} is over: it is {run.state} at attempt {run.attempt}.")
    return run


def end(session: Session, run: tables.Run, final: Final) -> None:
    """The worker has said its last word."""
    events = RunRepository(session)
    match final.outcome:
        case "completed":
            run.state = states.next_state(run.state, "complete")
            run.error = None
            events.add_event(run.id, "info", "Completed.", run.step)
        case "stopped":
            run.state = states.next_state(run.state, "halt")
            events.add_event(run.id, "info", "Stopped.", run.step)
        case "released":
            run.state = states.next_state(run.state, "release")
            events.add_event(run.id, "info", "The worker shut down and handed the run back.", run.step)
        case "failed":
            run.state = states.next_state(run.state, "fail")
            run.error = final.error
            events.add_event(run.id, "error", f"Failed: {final.error}", run.step)
        case "lost":
            lose(session, run, final.error or "The trainer process died.")
            return
    _settle(run)


def lose(session: Session, run: tables.Run, reason: str) -> None:
    """The attempt was lost for a reason: another one may do better, unless too many were lost without a new checkpoint."""
    events = RunRepository(session)
    events.add_event(run.id, "warning", f"Attempt {run.attempt} was lost: {reason}", run.step)
    losses = f"Attempt {run.attempt}: {reason}"
    run.error = f"{run.error}\n{losses}" if run.error else losses
    run.losses += 1
    if run.state == "running" and run.losses >= MAX_LOSSES:
        run.state = states.next_state(run.state, "fail")
        run.error = f"{run.losses} attempts in a row were lost without a new checkpoint.\n{run.error}"
        events.add_event(run.id, "error", f"Failed: {run.losses} attempts in a row were lost.", run.step)
    else:
        run.state = states.next_state(run.state, "lose")
    _settle(run)


def progressed(run: tables.Run) -> None:
    """A new checkpoint was registered: what went wrong before it counts no more."""
    run.losses = 0
    run.error = None


def _settle(run: tables.Run) -> None:
    """What holds for every run that no worker has."""
    now = time.time()
    run.worker = None
    if run.state in states.FINISHED:
        run.finished_at = now
    else:
        run.queued_at = now
