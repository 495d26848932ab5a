"""One attempt of a run: from the claim to the server's last acknowledgement, with everything in between wired together."""

import logging
import shutil
import threading
import time
from collections.abc import Callable
from pathlib import Path

from workers.errors import (
    ArchiveIntegrityError,
    CheckpointGoneError,
    RequestRefusedError,
    ServerUnavailableError,
)
from workers.protocol import Claim, Final, FinalOutcome, Orders
from workers.reporting import EvaluationResult
from workers.runtime.client import ServerClient
from workers.runtime.link import Link
from workers.runtime.output import Output
from workers.runtime.pipe import CheckpointReport, Control, Ended, EventReport, FrameReport, Job, MetricsReport, Report
from workers.runtime.settings import WorkerSettings
from workers.runtime.spool import Spool
from workers.runtime.trainer_handle import TrainerHandle
from workers.runtime.uploads import Uploads

logger = logging.getLogger(__name__)

_POLL_SECONDS = 0.1
_RETRY_SECONDS = 1.0
# What arrives damaged as often as this is damaged where it is kept.
_DAMAGED_DOWNLOADS = 3
# The last of an explanation is what tells most; the server takes 10,000 characters.
_EXPLANATION_CHARACTERS = 9_000
# A trainer that has said its last word has nothing left to do.
_EXIT_SECONDS = 5.0


class Attempt:
    """A claimed run on its way.

    Args:
        settings: of the worker.
        client: to the server.
        run_id: the run.
        claim: what the server granted.
        directory: a fresh directory for the spool and the archives; removed at the end.
        shutting_down: whether the worker should hand the run back.
    """

    def __init__(
        self,
        settings: WorkerSettings,
        client: ServerClient,
        run_id: str,
        claim: Claim,
        directory: Path,
        shutting_down: Callable[[], bool],
    ) -> None:
        self._settings = settings
        self._client = client
        self._run_id = run_id
        self._claim = claim
        self._directory = directory
        self._shutting_down = shutting_down
        self._changed = threading.Event()
        self._orders = Orders(ack=claim.last_seq)
        self._told = Control(stop=False, watch=None)
        self._telling = threading.Lock()
        self._ended: Ended | None = None
        self._broken: str | None = None
        self._local_fault: str | None = None
        self._trainer: TrainerHandle | None = None
        self._last_call: float | None = None
        self._step = claim.checkpoint.step if claim.checkpoint else 0
        directory.mkdir(mode=0o700)
        self._spool = Spool(directory / "spool.jsonl", claim.last_seq)
        self._uploads = Uploads(client, run_id, claim.attempt, self._spool)
        self._output = Output(client, run_id, claim.attempt)
        self._link = Link(
            settings.server_url,
            settings.worker_token.get_secret_value(),
            run_id,
            claim.attempt,
            self._spool,
            claim.lease_seconds,
            self._on_orders,
            self._on_link_broken,
        )

    @property
    def local_fault(self) -> str | None:
        """What was wrong with this worker or its machine rather than with the run; None where nothing was."""
        return self._local_fault

    def run(self, trainer: TrainerHandle) -> FinalOutcome | None:
        """Train, and return how that ended once the server knows it too; None where it fenced the attempt out or is gone.

        The trainer has ended when this returns, in every case.
        """
        try:
            final = self._train_or_explain(trainer)
            # Its last lines go before its last word: the next attempt may begin right after that.
            trainer.close()
            self._output.close()
            if final is None:
                return None
            self._link.finish(final)
            if not self._until_acknowledged():
                return None
            return final.outcome if self._broken is None else "lost"
        finally:
            trainer.close()
            self._output.close()
            self._uploads.close()
            self._link.close()
            self._spool.close()
            shutil.rmtree(self._directory, ignore_errors=True)

    # -- the trainer ------------------------------------------------------------------------------------------------------

    def _train_or_explain(self, trainer: TrainerHandle) -> Final | None:
        """`_train`; what goes wrong here, a full disk say, reaches the event log too."""
        try:
            return self._train(trainer)
        except Exception as error:
            logger.exception("run %s: attempt %d broke", self._run_id, self._claim.attempt)
            self._local_fault = f"{type(error).__name__}: {error}"
            return Final(outcome="lost", error=f"{type(error).__name__}: {error}"[-_EXPLANATION_CHARACTERS:])

    def _train(self, trainer: TrainerHandle) -> Final | None:
        try:
            resume = self._fetch_archive()
        except ServerUnavailableError:
            return Final(outcome="stopped" if self._orders.stop else "released")
        except (CheckpointGoneError, ArchiveIntegrityError) as error:
            # There is no older one of a policy to start from.
            return Final(outcome="damaged" if self._claim.checkpoint else "failed", error=str(error))
        except RequestRefusedError as error:
            return Final(outcome="failed", error=f"The archive to go on from cannot be fetched: {error}")
        if self._link.fenced():
            return None
        trainer.train(
            Job(
                training=self._claim.training.model_dump_json(),
                seed=self._claim.seed,
                directory=str(self._directory),
                resume=str(resume) if resume and self._claim.checkpoint else None,
                start=str(resume) if resume and not self._claim.checkpoint else None,
            ),
            self._on_report,
            self._output.line,
        )
        self._trainer = trainer
        self._tell(trainer)
        killed = self._until_trained(trainer)
        if self._link.fenced():
            logger.warning("run %s: attempt %d was fenced out", self._run_id, self._claim.attempt)
            return None
        trainer.close()
        final = self._final(trainer, killed)
        while not self._uploads.idle and not self._link.fenced():
            time.sleep(_POLL_SECONDS)
            if self._given_up():
                return None
        if self._uploads.refusal is not None:
            return Final(outcome="failed", error=self._uploads.refusal)
        if self._uploads.fault is not None and self._broken is None:
            self._break(self._uploads.fault)
        if self._broken is not None:
            return Final(outcome="lost", error=self._broken[:_EXPLANATION_CHARACTERS])
        return None if self._link.fenced() else final

    def _fetch_archive(self) -> Path | None:
        """What the training goes on from, or begins with; None for fresh weights."""
        checkpoint, start = self._claim.checkpoint, self._claim.start
        if checkpoint is None and start is None:
            return None
        path = self._directory / ("start.zip" if checkpoint is None else "resume.zip")
        damaged = 0
        while not self._link.fenced():
            try:
                if checkpoint is not None:
                    self._client.download(checkpoint, path)
                elif start is not None:
                    self._client.fetch_start(self._run_id, start, path)
            except (ServerUnavailableError, ArchiveIntegrityError) as error:
                logger.warning("run %s: the archive to begin with waits: %s", self._run_id, error)
                damaged += isinstance(error, ArchiveIntegrityError)
                if self._stop_wanted() or damaged == _DAMAGED_DOWNLOADS:
                    raise
                time.sleep(_RETRY_SECONDS)
            else:
                return path
        return None

    def _until_trained(self, trainer: TrainerHandle) -> bool:
        """Wait for the trainer's end, or bring it about; returns whether it had to be killed after a stop."""
        deadline: float | None = None
        while self._ended is None and trainer.alive:
            if self._uploads.fault is not None:
                self._break(self._uploads.fault)
            if self._link.fenced() or self._uploads.refusal is not None or self._broken is not None:
                trainer.kill()
                return False
            if self._stop_wanted():
                self._tell(trainer)
                limit = time.monotonic() + (
                    self._settings.release_grace_seconds if self._shutting_down() else self._settings.stop_grace_seconds
                )
                deadline = limit if deadline is None else min(deadline, limit)
            if deadline is not None and time.monotonic() > deadline:
                trainer.kill()
                return True
            self._changed.wait(_POLL_SECONDS)
            self._changed.clear()
        trainer.wait(_EXIT_SECONDS)
        return False

    def _final(self, trainer: TrainerHandle, killed: bool) -> Final:
        """What the end of the trainer means for the run."""
        ended = self._ended
        if self._broken is not None:
            return Final(outcome="lost", error=self._broken[:_EXPLANATION_CHARACTERS])
        if ended is not None and ended.outcome == "completed":
            return Final(outcome="completed")
        if ended is not None and ended.outcome == "failed":
            return Final(outcome="failed", error=(ended.error or "")[-_EXPLANATION_CHARACTERS:])
        if ended is not None and ended.outcome == "damaged":
            return Final(outcome="damaged", error=(ended.error or "")[-_EXPLANATION_CHARACTERS:])
        if ended is not None and ended.outcome == "unfit":
            self._local_fault = ended.error
            return Final(outcome="lost", error=f"The trainer could not go on here: {ended.error}"[:_EXPLANATION_CHARACTERS])
        if killed:
            self._spool.event(
                self._step, "warning", "The trainer did not end in time and was killed: it goes on from its last checkpoint."
            )
        if killed or ended is not None:
            return Final(outcome="stopped" if self._orders.stop else "released")
        return Final(outcome="lost", error=trainer.cause_of_death()[-_EXPLANATION_CHARACTERS:])

    # -- what comes in, on other threads ----------------------------------------------------------------------------------

    def _on_report(self, report: Report) -> None:
        if self._broken is not None:
            return
        try:
            self._take(report)
        except (OSError, ValueError) as error:
            # A full disk, say: this attempt can tell no more, and the trainer must not wait for somebody who listens.
            self._break(f"The worker could not pass on what the training reports: {error}")

    def _take(self, report: Report) -> None:
        match report:
            case MetricsReport():
                self._step = report.step
                self._spool.metrics(report.step, report.at, report.values)
                self._link.notify()
            case EventReport():
                self._spool.event(report.step, report.level, report.message[:10_000])
                self._link.notify()
            case CheckpointReport():
                evaluation = EvaluationResult.model_validate_json(report.evaluation) if report.evaluation else None
                self._uploads.put(report.step, Path(report.archive), evaluation)
            case FrameReport():
                if self._orders.watch is not None:
                    self._link.frame(report.data)
            case Ended():
                self._ended = report
                self._changed.set()

    def _on_link_broken(self, reason: str) -> None:
        """Something that was reported will never arrive: the run goes back to a checkpoint from before."""
        self._break(f"What the training reported can't be told to the server: {reason}")
        self._uploads.drop_beyond(self._spool.acked)

    def _break(self, reason: str) -> None:
        logger.error("run %s: attempt %d cannot go on: %s", self._run_id, self._claim.attempt, reason)
        self._local_fault = self._broken = reason
        self._changed.set()

    def _on_orders(self, orders: Orders) -> None:
        self._orders = orders
        self._uploads.notify()
        if self._trainer is not None:
            self._tell(self._trainer)
        self._changed.set()

    # ---------------------------------------------------------------------------------------------------------------------

    def _stop_wanted(self) -> bool:
        return self._orders.stop or self._shutting_down()

    def _tell(self, trainer: TrainerHandle) -> None:
        with self._telling:
            watch = self._orders.watch
            control = Control(stop=self._stop_wanted(), watch=watch.model_dump_json() if watch else None)
            if control != self._told:
                self._told = control
                trainer.control(control)

    def _until_acknowledged(self) -> bool:
        while not self._link.wait(_POLL_SECONDS):
            if self._given_up():
                return False
        return not self._link.fenced()

    def _given_up(self) -> bool:
        """Whether the worker must go although the server does not answer: the lease will run out, the run goes on later."""
        if not self._shutting_down():
            return False
        if self._last_call is None:
            self._last_call = time.monotonic() + self._settings.release_grace_seconds
        return time.monotonic() > self._last_call
