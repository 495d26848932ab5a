"""The Celery task: claim the run that a message names, and see it through. It imports nothing slow."""

import logging
import multiprocessing
import signal
import time
import uuid
from typing import Any

import billiard
from celery import shared_task
from celery.signals import worker_init, worker_process_init, worker_process_shutdown, worker_ready, worker_shutting_down

from workers.errors import RequestRefusedError, RunRefusedError, ServerUnavailableError, UnfitError
from workers.logs import process_is_about
from workers.protocol import Claim
from workers.runtime.app import TRAIN_TASK
from workers.runtime.attempt import Attempt
from workers.runtime.ending import drain_on_signal, leave_when_idle
from workers.runtime.fitness import make_private
from workers.runtime.nursery_keeper import door
from workers.runtime.settings import WorkerSettings
from workers.runtime.slot import Slot, remove_leftovers
from workers.runtime.trainer_handle import TrainerHandle

logger = logging.getLogger(__name__)

# A server that is away this long rings again when it is back.
_CLAIM_PATIENCE_SECONDS = 60.0
_CLAIM_RETRY_SECONDS = 0.5

# Set in the worker's main process, seen in the processes that it forks.
_shutting_down = multiprocessing.get_context("fork").Event()
_slot: Slot | None = None


def _prepare_worker(**_: Any) -> None:
    # A line for every heartbeat would bury what matters.
    logging.getLogger("httpx").setLevel(logging.WARNING)
    settings = WorkerSettings()
    make_private(settings.work_dir)
    remove_leftovers(settings.work_dir)


def _watch_for_the_end(**_: Any) -> None:
    settings = WorkerSettings()
    drain_on_signal()
    if settings.until_idle_seconds is not None:
        leave_when_idle(settings.work_dir, settings.until_idle_seconds)


def _open_slot(**_: Any) -> None:
    global _slot  # one a process, made after the fork
    _slot = Slot(WorkerSettings(), billiard.current_process().index, _shutting_down.is_set, door())


def _announce_shutdown(**_: Any) -> None:
    _shutting_down.set()


def _close_slot(**_: Any) -> None:
    if _slot is not None:
        _slot.close()


worker_init.connect(_prepare_worker)
worker_ready.connect(_watch_for_the_end)
worker_process_init.connect(_open_slot)
worker_shutting_down.connect(_announce_shutdown)
worker_process_shutdown.connect(_close_slot)


@shared_task(name=TRAIN_TASK)
def train(run_id: str, attempt: int) -> None:
    """Train the run that comes first in the queue: this one at `attempt`, or another; a message too many is dropped."""
    _train(run_id, attempt)


def _train(run_id: str, attempt: int) -> None:
    assert _slot is not None
    # A batch system may tell every process of a job to end; the one that trains hands its run back first. Here and not where
    # the process begins: Celery puts its own handler in place after that.
    signal.signal(signal.SIGTERM, _slot.on_terminate)
    try:
        trainer = _slot.take_trainer()
    except UnfitError as error:
        # The server rings again, and while this worker rests another one hears it.
        if not _slot.shutting_down():
            _slot.rest(str(error))
        return
    try:
        claim = _claim(_slot, run_id, attempt)
        if claim is None:
            return
        with process_is_about(claim.run_id or run_id):
            logger.info("run %s: attempt %d begins", claim.run_id or run_id, claim.attempt)
            fault = _see_through(_slot, claim.run_id or run_id, claim, trainer)
    finally:
        _slot.give_back(trainer)
    if fault is None:
        _slot.well()
    else:
        _slot.rest(fault)


def _see_through(slot: Slot, run_id: str, claim: Claim, trainer: TrainerHandle) -> str | None:
    """Bring a claimed run to the end of its attempt; returns what was wrong with this machine, if anything was."""
    try:
        work = Attempt(slot.settings, slot.client, run_id, claim, slot.directory(run_id, claim.attempt), slot.shutting_down)
    except OSError as error:
        logger.exception("run %s: attempt %d cannot keep its files; it goes on after its lease", run_id, claim.attempt)
        return f"{type(error).__name__}: {error}"
    outcome = work.run(trainer)
    logger.info("run %s: attempt %d ended: %s", run_id, claim.attempt, outcome or "given up")
    return work.local_fault


def _claim(slot: Slot, run_id: str, attempt: int) -> Claim | None:
    deadline = time.monotonic() + _CLAIM_PATIENCE_SECONDS
    claim_id = uuid.uuid4().hex
    waited = False
    while time.monotonic() < deadline and not slot.shutting_down():
        try:
            return slot.client.claim(run_id, slot.name, attempt, claim_id, slot.settings.worker_queue)
        except RunRefusedError as refusal:
            logger.info("run %s is not to be had at attempt %d: %s", run_id, attempt, refusal)
            return None
        except RequestRefusedError:
            logger.exception("run %s cannot be claimed", run_id)
            return None
        except ServerUnavailableError as error:
            if not waited:
                logger.warning("run %s waits for the server to answer: %s", run_id, error)
            waited = True
            time.sleep(_CLAIM_RETRY_SECONDS)
    return None
