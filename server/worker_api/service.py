"""What workers may do, each in one transaction, and what follows from it for everybody else."""

import logging
import time
from collections.abc import Iterator, Sequence

from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from server.arenas.references import with_geometry
from server.checkpoints.archives import LooseArchives
from server.checkpoints.integrity import is_whole
from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.errors import ConflictError, DatabaseBusyError, NotFoundError, PartAwayError
from server.events.changes import Change, ChangeKind
from server.experiments.stored import StoredTraining, read_training, training_of
from server.files import StoredFile
from server.lineage.starts import start_archive
from server.replays.ahead import make_ahead
from server.runs import states
from server.runs.repository import RunRepository
from server.runs.service import RunService, takers
from server.runs.shares import ShareRepository, Shares
from server.security.principal import WORKER, Principal
from server.services import Services
from server.system.repository import WorkerRepository
from server.worker_api import attempts
from server.worker_api.attempts import FencedError
from server.worker_api.batches import in_turn
from server.worker_api.errors import TooEarlyError
from server.worker_api.ingest import Outcome, Report
from server.worker_api.items import ReportedItems
from server.worker_api.losses import exhausted, hopeful
from sim.extending.discovery import missing, wording
from workers.config import TrainingConfig
from workers.logs import about
from workers.protocol import (
    CheckpointReference,
    CheckpointUpload,
    Claim,
    ClaimRequest,
    Final,
    Heartbeat,
    HeartbeatAnswer,
    MetricItem,
    Orders,
    device_of,
    queues_of,
)
from workers.wording import counted

logger = logging.getLogger(__name__)

# What ends otherwise is worth a warning.
_AS_IT_SHOULD = ("completed", "stopped", "released")


class WorkerService:
    """The worker API's transactions. Synchronous: call it on a thread."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def heartbeat(self, heartbeat: Heartbeat) -> HeartbeatAnswer:
        """Note that a worker is there; what it should do."""
        with self._services.database.write() as session:
            workers = WorkerRepository(session)
            workers.seen(
                heartbeat.worker, heartbeat.queue, time.time(), heartbeat.trouble, heartbeat.extensions, heartbeat.machine
            )
            if heartbeat.first:
                workers.drain([heartbeat.worker], None)
            return HeartbeatAnswer(drain=workers.is_drained(heartbeat.worker))

    def claim(self, run_id: str, request: ClaimRequest, principal: Principal = WORKER) -> Claim:
        """Give a run to a worker, if it is still to be had; the run remembers with whose token it was claimed.

        Who takes any run gets the first in the queue that it can train: should the message that woke it have been about
        another one, its turn comes with the next message.

        Raises:
            NotFoundError: there is no such run.
            ConflictError: it is not to be had at this attempt, or can't be trained any more.
        """
        problem: str | None = None
        with self._services.database.write() as session:
            sharing = ShareRepository(session)
            sharing.lock()
            shares = sharing.read(self._services.settings.limits)
            run, request = _in_turn(session, run_id, request, shares)
            is_fresh = run.state == "queued"
            if is_fresh and (limit := shares.waits_for(run)) is not None:
                raise ConflictError(f"Run {run.id} waits: as many are under way as may be ({limit}).")
            # At once, not from the worker's next heartbeat on; a claim whose answer got lost is asked for once more.
            drained = WorkerRepository(session).takes_up(request.worker, run.id)
            if drained and run.claim_id != (request.claim_id or ""):
                raise ConflictError("This worker was asked to take up no more runs.")
            stored = read_training(run.experiment.training)
            _refuse_without_extensions(run, stored, request)
            training = _on_device(run, stored.training, request)
            if run.state in states.ACTIVE and run.claimed_with != principal.credential:
                raise ConflictError(f"Run {run.id} was claimed with another token.")
            # Who has lost it too often leaves it to others.
            others = takers(session, run, stored.training) if exhausted(run, request.worker) else ()
            checkpoint = attempts.begin(session, run, request, others)
            if principal.credential is not None and run.claimed_with != principal.credential:
                RunRepository(session).add_event(run.id, "info", f"Claimed with the token {principal.name}.", run.step)
            run.claimed_with = principal.credential
            if is_fresh:
                sharing.took(run.experiment, shares)
            if stored.unreadable:
                problem = stored.why_not
            try:
                training = with_geometry(training, self._services.arenas)
            except NotFoundError as error:
                problem = f"The arena is gone: {error.message}"
            if problem is not None:
                attempts.end(session, run, Final(outcome="failed", error=problem))
            claim = Claim(
                run_id=run.id,
                attempt=run.attempt,
                seed=run.seed,
                training=training,
                last_seq=run.last_seq,
                checkpoint=CheckpointReference(id=checkpoint.id, step=checkpoint.step, sha256=checkpoint.sha256)
                if checkpoint
                else None,
                start=training.start_from.sha256 if training.start_from and not checkpoint else None,
                lease_seconds=self._services.settings.lease_seconds,
            )
        self._services.instruments.claims.labels(request.queue).inc()
        self._services.leases.renew(run.id, claim.attempt)
        self._publish(run, "run")
        if is_fresh:
            origin = f"step {counted(checkpoint.step)}" if checkpoint else "the start"
            _say(run.id, logging.INFO, f"attempt {claim.attempt} begins from {origin} on {request.worker}")
        if problem is not None:
            _say(run.id, logging.ERROR, f"attempt {claim.attempt} ended: failed: {problem}")
            raise ConflictError(problem)
        return claim

    def receive(self, reports: Sequence[Report]) -> list[Outcome]:
        """Store what workers report, once, all in one transaction.

        Where the transaction fails, each report gets one of its own: what is wrong with one is no other's trouble.

        Returns:
            For each report what its worker is to know, or why it was not stored: FencedError if the attempt is over.
        """
        try:
            return self._receive(reports)
        except (OperationalError, PartAwayError, DatabaseBusyError) as error:
            # The database is away or busy, for everybody.
            return [error] * len(reports)
        except Exception as error:
            if len(reports) == 1:
                return [error]
            return [outcome for report in reports for outcome in self.receive([report])]

    def _receive(self, reports: Sequence[Report]) -> list[Outcome]:
        outcomes: list[Outcome] = []
        changes: dict[Change, None] = {}
        ended: list[tuple[tables.Run, int, Final]] = []
        lost = 0
        # A sign of life alone changes nothing in the database.
        is_read = not any(report.batch.items or report.batch.final for report in reports)
        with self._services.database.read() if is_read else self._services.database.write() as session:
            runs = RunRepository(session).several(
                {report.run_id for report in reports},
                for_update=not is_read,
                with_experiments=any(report.batch.final for report in reports),
            )
            items = ReportedItems(session)
            for report in reports:
                try:
                    run = attempts.unfenced(runs.get(report.run_id), report.run_id, report.attempt)
                except FencedError as error:
                    outcomes.append(error)
                    continue
                batch, gap = in_turn(report.batch, run.last_seq)
                items.add(run, batch.items)
                if batch.final is not None:
                    items.write()
                    damaged = session.get(tables.Checkpoint, report.damaged) if report.damaged else None
                    attempts.end(session, run, batch.final, takers(session, run, training_of(run.experiment)), damaged)
                    ended.append((run, report.attempt, batch.final))
                    lost += batch.final.outcome == "lost"
                outcomes.append(
                    Orders(
                        ack=run.last_seq,
                        refused=gap or report.refused,
                        stop=run.state == "stopping",
                        over=batch.final is not None,
                    )
                )
                for item in batch.items:
                    kind: ChangeKind = "metrics" if isinstance(item, MetricItem) else "run"
                    changes[Change(experiment_id=run.experiment_id, run_id=run.id, kind=kind)] = None
            items.write()
        self._services.grown.add(items.grown)
        self._services.instruments.losses.inc(lost)
        for change in changes:
            self._services.bus.publish(change)
        for run, attempt, final in ended:
            reason = f": {final.error}" if final.error else ""
            level = logging.INFO if final.outcome in _AS_IT_SHOULD else logging.WARNING
            _say(run.id, level, f"attempt {attempt} ended at step {counted(run.step)}: {final.outcome}{reason}")
            self._announce(run)
            if final.outcome == "completed":
                make_ahead(self._services, run.id)
        return outcomes

    def damaged(self, run_id: str) -> str | None:
        """The id of the checkpoint that the run should go on from, where its archive is damaged; reads all of it."""
        with self._services.database.read() as session:
            checkpoint = CheckpointRepository(session).last(run_id)
        try:
            return None if checkpoint is None or is_whole(self._services.files, checkpoint) else checkpoint.id
        except OSError:
            logger.exception("checkpoint %s cannot be looked at: it counts as whole", run_id)
            return None

    def announce(self, run_id: str, attempt: int, after_seq: int, archive_id: str) -> None:
        """Before a checkpoint's bytes are taken in: whether it would be registered, and that its archive is on its way.

        Raises:
            FencedError: the attempt is over.
            TooEarlyError: the metrics before the checkpoint have not arrived.
        """
        with self._services.database.write() as session:
            run = attempts.unfenced(RunRepository(session).find(run_id), run_id, attempt)
            if run.last_seq < after_seq:
                raise TooEarlyError(f"Item {after_seq} must be here before this checkpoint; the last one is {run.last_seq}.")
            LooseArchives(session).begin(archive_id)

    def register(self, run_id: str, attempt: int, step: int, file: StoredFile, upload: CheckpointUpload) -> bool:
        """Register an archive that is complete in the store; one that comes again is registered once.

        Returns:
            Whether it is new; the file of one that is not can be removed.

        Raises:
            FencedError: the attempt is over.
            TooEarlyError: it must be sent again.
        """
        with self._services.database.write() as session:
            run = attempts.unfenced(RunRepository(session).find(run_id, for_update=True), run_id, attempt)
            checkpoints = CheckpointRepository(session)
            if checkpoints.at_step(run_id, step) is not None:
                return False
            if not LooseArchives(session).register(file.id):
                raise TooEarlyError("The archive took too long and was removed: send it again.")
            checkpoints.add(run_id, step, file, upload.evaluation)
            attempts.progressed(run)
        self._publish(run, "checkpoint")
        return True

    def lose_expired(self) -> None:
        """Take the runs whose lease has run out away from their workers."""
        leases = self._services.leases
        with self._services.database.read() as session:
            expired = leases.expired(RunRepository(session).active_attempts())
        if not expired:
            return
        with self._services.database.write() as session:
            silent = {run_id for run_id, _ in expired}
            runs = [
                run
                for run in RunRepository(session).several(silent, for_update=True, with_experiments=True).values()
                # Its worker may have been heard since, or have ended it.
                if run.state in states.ACTIVE and leases.is_expired(run.id, run.attempt)
            ]
            reasons = {
                run.id: f"worker {run.worker} was not heard of for {self._services.settings.lease_seconds:g} s."
                for run in runs
            }
            for run in runs:
                attempts.lose(session, run, reasons[run.id], takers(session, run, training_of(run.experiment)))
        self._services.instruments.losses.inc(len(runs))
        for run in runs:
            _say(run.id, logging.WARNING, f"attempt {run.attempt} was lost: {reasons[run.id]}")
            self._services.links.cut(run.id)
            self._announce(run)

    def check_claimed(self, run_id: str, principal: Principal) -> None:
        """Refuse a report on a run that was claimed with another token: one machine taken over is not all of them.

        Raises:
            FencedError: it was.
        """
        with self._services.database.read() as session:
            run = RunRepository(session).find(run_id)
            if run is not None and run.claimed_with != principal.credential:
                raise attempts.FencedError(f"Run {run_id} was claimed with another token.")

    def download(self, checkpoint_id: str, principal: Principal = WORKER) -> Iterator[bytes]:
        """A checkpoint's archive.

        Raises:
            NotFoundError: there is no such checkpoint, its run was claimed with another token, or its file is gone.
        """
        with self._services.database.read() as session:
            checkpoint = CheckpointRepository(session).get(checkpoint_id)
            if RunRepository(session).get(checkpoint.run_id).claimed_with != principal.credential:
                raise NotFoundError.of("checkpoint", checkpoint_id)
        return self._services.files.read(checkpoint_id)

    def start(self, run_id: str, principal: Principal = WORKER) -> Iterator[bytes]:
        """The archive of the policy that a run begins with.

        Raises:
            NotFoundError: there is no such run, it was claimed with another token, it begins with fresh weights, or the
                policy is gone.
        """
        with self._services.database.read() as session:
            run = RunRepository(session).get(run_id)
            start = training_of(run.experiment).start_from
            if run.state not in states.ACTIVE or run.claimed_with != principal.credential or start is None:
                raise NotFoundError.of("policy to start from of run", run_id)
        return start_archive(start, self._services.files)

    def _announce(self, run: tables.Run) -> None:
        """After an attempt's end: tell whoever looks on, and wake another worker where the run waits for one."""
        if run.state == "queued":
            RunService(self._services).announce_queued(run)
        else:
            self._publish(run, "run")

    def _publish(self, run: tables.Run, kind: ChangeKind) -> None:
        self._services.bus.publish(Change(experiment_id=run.experiment_id, run_id=run.id, kind=kind))


def _say(run_id: str, level: int, message: str) -> None:
    """A line of the server's log, after the commit; what an object a line says of the run is said of this one."""
    with about(run_id):
        logger.log(level, "run %s: %s", run_id, message)


def _refuse_without_extensions(run: tables.Run, stored: StoredTraining, request: ClaimRequest) -> None:
    """Leave a run that needs extensions to a worker that has them.

    Raises:
        ConflictError: this one lacks one, or the service itself does.
    """
    if stored.lacking:
        raise ConflictError(stored.why_not)
    there = {one.name: one.version for one in request.extensions}
    if not stored.unreadable and (lacking := missing(stored.training.extensions, there)):
        raise ConflictError(f"Run {run.id} needs {wording(lacking)}, which {request.worker} does not have.")


def _in_turn(session: Session, run_id: str, request: ClaimRequest, shares: Shares) -> tuple[tables.Run, ClaimRequest]:
    """The run that a worker is given, if it may have it, and the request as if it had asked for that one.

    Raises:
        NotFoundError: there is no such run, and no other one for it.
    """
    runs = RunRepository(session)
    if request.any_run:
        if request.claim_id is not None and (held := runs.claimed_under(request.claim_id)) is not None:
            return runs.get(held, for_update=True), request
        for waiting in runs.in_turn(shares):
            if _can_train(session, waiting, request) and (run := runs.take(waiting.id)) is not None:
                return run, request.model_copy(update={"published_attempt": run.attempt})
    return runs.get(run_id, for_update=True), request


def _can_train(session: Session, run: tables.Run, request: ClaimRequest) -> bool:
    stored = read_training(run.experiment.training)
    there = {one.name: one.version for one in request.extensions}
    if stored.lacking or request.queue not in queues_of(stored.training, run.device):
        return False
    if not stored.unreadable and missing(stored.training.extensions, there):
        return False
    return not (exhausted(run, request.worker) and hopeful(run, takers(session, run, stored.training)))


def _on_device(run: tables.Run, training: TrainingConfig, request: ClaimRequest) -> TrainingConfig:
    """The training with the device that it is trained on, which the first claim decides where that is open.

    Raises:
        ConflictError: the worker is of a queue that trains on another device.
    """
    queues = queues_of(training, run.device)
    if request.queue not in queues:
        raise ConflictError(
            f"Run {run.id} is trained on {device_of(queues[0])}: a worker of the queue {queues[0]} takes it up, and "
            f"{request.worker} is of {request.queue}."
        )
    if training.device != "auto":
        return training
    run.device = device_of(request.queue)
    return training.model_copy(update={"device": run.device})
