"""What a trainer's process does: waits for its one job, trains, and reports to the Celery task that began it.

It is forked from the slot's nursery (`workers.runtime.nursery_process`). Whatever libraries print goes to the slot line by
line, into the run's log; the last lines explain a crash.
"""

import os
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path

from sim.arenas import with_maps_of
from sim.errors import SimError
from workers.config import TrainingConfig
from workers.errors import ArchiveFormatError, ArchiveIntegrityError, LocalError, WorkerError
from workers.frames import Frame
from workers.reporting import EvaluationResult, EventLevel, WatchRequest
from workers.runtime.pipe import (
    CheckpointReport,
    Control,
    Ended,
    EventReport,
    FrameReport,
    Job,
    MetricsReport,
    Order,
    Receiver,
    Report,
    Sender,
    orders,
)

# Frames that wait for the pipe, at most: two thirds of a second at 30 a second. Older ones are worth nothing.
_FRAME_BACKLOG = 20


class PipeReporter:
    """The `Reporter` of a trainer process: a thread writes to the pipe, the training never waits for it."""

    def __init__(self, sender: Sender) -> None:
        self._sender = sender
        self._condition = threading.Condition()
        self._reports: deque[Report] = deque()
        self._frames: deque[Frame] = deque(maxlen=_FRAME_BACKLOG)
        self._control = Control(stop=False, watch=None)
        self._watch: WatchRequest | None = None
        self._closed = False
        self._thread = threading.Thread(target=self._write, name="reports", daemon=True)
        self._thread.start()

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """Numbers at an environment step."""
        self._put(MetricsReport(step, time.time(), {name: float(value) for name, value in values.items()}))

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """One line for the run's event log."""
        self._put(EventReport(step, level, message))

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """A checkpoint archive that is complete on disk; the task removes it once the server has it."""
        self._put(CheckpointReport(step, str(archive), evaluation.model_dump_json() if evaluation else None))

    def frames(self, frames: Sequence[Frame]) -> None:
        """Moments for whoever watches; the oldest are dropped where the pipe is slower than the view."""
        if self._watch is None:
            return
        with self._condition:
            self._frames.extend(frames)
            self._condition.notify()

    @property
    def watch(self) -> WatchRequest | None:
        """What somebody wants to see now."""
        return self._watch

    @property
    def stop_requested(self) -> bool:
        """True once the training should write a checkpoint and return."""
        return self._control.stop

    def obey(self, control: Control) -> None:
        """Take in what the task says."""
        self._control = control
        self._watch = WatchRequest.model_validate_json(control.watch) if control.watch else None

    def end(self, outcome: str, error: str | None = None) -> None:
        """Say the last word, and wait until everything is written."""
        self._put(Ended(outcome, error))
        with self._condition:
            self._closed = True
            self._condition.notify()
        self._thread.join()

    def _put(self, report: Report) -> None:
        with self._condition:
            self._reports.append(report)
            self._condition.notify()

    def _write(self) -> None:
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._reports or self._frames or self._closed)
                if self._reports:
                    report = self._reports.popleft()
                elif self._closed:
                    return
                else:
                    frame, report = self._frames.popleft(), None
            try:
                self._sender.send(report if report is not None else FrameReport(frame.encode()))
            except BrokenPipeError:
                return  # the task is gone, and so will this process be in a moment


def _listen(incoming: Receiver[Order], reporter: PipeReporter) -> None:
    while (order := incoming.receive()) is not None:
        if isinstance(order, Control):
            reporter.obey(order)
    os._exit(1)  # nobody is left to report to


def train_as_told(orders_descriptor: int, reports_descriptor: int) -> None:
    """Wait for a job, train, report.

    Args:
        orders_descriptor: to read `workers.runtime.pipe.Order` from; where it closes, this process ends.
        reports_descriptor: to write reports to.
    """
    # With their seconds of imports: they are there already where the nursery has forked this process.
    from workers.live.viewer import LiveViewer
    from workers.training.trainer import train

    # Left open: the thread that listens would have to let go of it first.
    incoming = orders(os.fdopen(orders_descriptor, "rb"))
    with os.fdopen(reports_descriptor, "wb") as told:
        job = incoming.receive()
        if not isinstance(job, Job):
            return
        reporter = PipeReporter(Sender(told))
        threading.Thread(target=_listen, args=(incoming, reporter), name="orders", daemon=True).start()
        try:
            config = TrainingConfig.model_validate_json(job.training)
            outcome = train(
                config,
                job.seed,
                reporter,
                Path(job.directory),
                Path(job.resume) if job.resume else None,
                Path(job.start) if job.start else None,
                viewer=LiveViewer(with_maps_of(config.task, job.seed), reporter),
            )
        except (ArchiveFormatError, ArchiveIntegrityError) as error:
            # Whether a checkpoint is damaged where it is kept as well is for the server to say.
            reporter.end("damaged" if job.resume else "failed", str(error))
        except (OSError, LocalError) as error:
            reporter.end("unfit", f"{type(error).__name__}: {error}")
        except (WorkerError, SimError, ValueError) as error:
            # Typed, or about a value of the configuration: another attempt would meet it again.
            reporter.end("failed", f"{type(error).__name__}: {error}")
        else:
            reporter.end(outcome)
