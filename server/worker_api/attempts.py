"""How an attempt begins and ends, as changes to a run's row within the caller's transaction.

The attempt's number is the fencing token: `unfenced` refuses every older one, so whatever a worker says after it has lost
its run changes nothing.
"""

import time
from collections.abc import Collection

from sqlalchemy.orm import Session

from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.errors import ConflictError, NotFoundError
from server.metrics.repository import MetricRepository
from server.runs import states
from server.runs.repository import RunRepository
from server.worker_api.losses import MAX_LOSSES, count_loss, exhausted, hopeful, too_many
from workers.protocol import ClaimRequest, Final
from workers.wording import counted


class FencedError(ConflictError):
    """The attempt is over: a newer one runs, its lease ran out, or the run has ended or was deleted."""


def begin(session: Session, run: tables.Run, request: ClaimRequest, others: Collection[str]) -> tables.Checkpoint | None:
    """Give the run to a worker; what was reported beyond its last checkpoint is dropped.

    Args:
        session: the transaction.
        run: locked.
        request: what the worker asks for. Asked again under the same claim id, because the answer got lost, the run is its.
        others: the workers that take up runs of this queue now.

    Returns:
        The checkpoint to go on from; None for a fresh start.

    Raises:
        ConflictError: the run does not wait for this worker at this attempt (any more).
    """
    checkpoint = CheckpointRepository(session).last(run.id)
    if run.state in states.ACTIVE and run.claim_id is not None and run.claim_id == request.claim_id:
        return checkpoint
    if run.state != "queued" or run.attempt != request.published_attempt:
        raise ConflictError(
            f"Run {run.id} is {run.state} at attempt {run.attempt}: it is not to be had at {request.published_attempt}."
        )
    if exhausted(run, request.worker) and hopeful(run, others):
        raise ConflictError(f"{request.worker} lost run {run.id} {MAX_LOSSES} times: it waits for another worker.")
    run.state = states.next_state(run.state, "claim")
    run.attempt += 1
    run.worker = request.worker
    run.claim_id = request.claim_id
    run.started_at = run.started_at or time.time()
    _rewind(session, run, checkpoint)
    origin = f"from step {counted(checkpoint.step)}" if checkpoint else "from the start"
    message = f"Attempt {run.attempt} begins {origin} on {request.worker}."
    RunRepository(session).add_event(run.id, "info", message, run.step)
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


def end(
    session: Session,
    run: tables.Run,
    final: Final,
    others: Collection[str] = (),
    damaged: tables.Checkpoint | None = None,
) -> None:
    """The worker has said its last word.

    Args:
        session: the transaction.
        run: locked.
        final: the last word.
        others: the workers that take up runs of this queue now.
        damaged: the checkpoint that it could not read, where the one in the store is damaged indeed.
    """
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
            lose(session, run, final.error or "The trainer process died.", others)
            return
        case "damaged":
            _fall_back(session, run, damaged, final.error or "it cannot be read", others)
            return
    _settle(run)


def lose(session: Session, run: tables.Run, reason: str, others: Collection[str]) -> None:
    """The attempt was lost for a reason: another one may do better, unless too many were lost without a new checkpoint.

    `server.worker_api.losses` says how many are too many; `others` are those that take up runs of this queue now.
    """
    events = RunRepository(session)
    events.add_event(run.id, "warning", f"Attempt {run.attempt} was lost: {reason}", run.step)
    losses = f"Attempt {run.attempt}: {reason}"
    run.error = f"{run.error}\n{losses}" if run.error else losses
    count_loss(run)
    if run.state == "running" and too_many(run, others):
        run.state = states.next_state(run.state, "fail")
        run.error = f"{run.losses} attempts in a row were lost without a new checkpoint.\n{run.error}"
        events.add_event(run.id, "error", f"Failed: {run.losses} attempts in a row were lost.", run.step)
    else:
        run.state = states.next_state(run.state, "lose")
    _settle(run)


def progressed(run: tables.Run) -> None:
    """A new checkpoint was registered: what went wrong before it counts no more."""
    run.losses, run.lost_by = 0, None
    run.error = None


def _rewind(session: Session, run: tables.Run, checkpoint: tables.Checkpoint | None) -> None:
    """Forget what was reported beyond a checkpoint."""
    run.step = checkpoint.step if checkpoint else 0
    # A step of its own for a fresh start: points at step 0 go too.
    MetricRepository(session).drop_beyond(run.id, checkpoint.step if checkpoint else -1)


def _fall_back(
    session: Session, run: tables.Run, damaged: tables.Checkpoint | None, reason: str, others: Collection[str]
) -> None:
    """The worker could not read the checkpoint to go on from: go on from the one before, where it is damaged indeed."""
    if damaged is None:
        lose(session, run, f"{reason}, although the checkpoint is whole where it is kept.", others)
        return
    damaged.damaged_at = time.time()
    session.flush()
    checkpoint = CheckpointRepository(session).last(run.id)
    _rewind(session, run, checkpoint)
    origin = f"step {counted(checkpoint.step)}" if checkpoint else "the start"
    message = f"The checkpoint of step {counted(damaged.step)} is damaged ({reason}): the run goes on from {origin}."
    RunRepository(session).add_event(run.id, "warning", message, run.step)
    run.state = states.next_state(run.state, "lose")
    _settle(run)


def _settle(run: tables.Run) -> None:
    """What holds for every run that no worker has."""
    now = time.time()
    run.worker = None
    run.claim_id = None
    if run.state in states.FINISHED:
        run.finished_at = now
    else:
        run.queued_at = now
