"""One process of a Celery worker: tells the server that it is there, keeps a trainer process ready, and knows when to go."""

import logging
import os
import shutil
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType

from workers.errors import ServerError, UnfitError
from workers.protocol import HEARTBEAT_SECONDS
from workers.runtime.client import ServerClient
from workers.runtime.ending import DRAIN_SIGNAL
from workers.runtime.fitness import HEARTBEAT_FILE, Fitness
from workers.runtime.machine import MachineWatch
from workers.runtime.settings import WorkerSettings
from workers.runtime.sight import ServerSight
from workers.runtime.trainer_handle import TrainerHandle

logger = logging.getLogger(__name__)

_TICK_SECONDS = 0.5
_READY_POLL_SECONDS = 0.05
# The server takes 10,000.
_TROUBLE_CHARACTERS = 2_000
# Between two trials to keep a trainer ready, where it dies on its own.
_FIRST_RETRY_SECONDS = 1.0
_LAST_RETRY_SECONDS = 60.0
# Imports take seconds; on a fresh checkout the simulation's kernels are compiled first, which takes a minute.
_TRAINER_PATIENCE_SECONDS = 300.0


class Slot:
    """A place in which one training at a time runs. Its keeper thread lives as long as the process.

    Importing PyTorch and numba takes seconds, more than a person wants to wait for the first point of a curve: so a trainer
    process waits with all imports done while the slot is idle, and none does while the slot trains.

    Args:
        settings: of the worker.
        number: of this process among the worker's, from 0.
        shutting_down: whether the worker has been asked to end.
    """

    def __init__(self, settings: WorkerSettings, number: int, shutting_down: Callable[[], bool]) -> None:
        self.settings = settings
        self.name = settings.name(number)
        self.client = ServerClient(settings.server_url, settings.worker_token.get_secret_value())
        self._parent = os.getppid()
        self._worker_shutting_down = shutting_down
        self._condition = threading.Condition()
        self._terminated = False
        self._draining = False
        self._busy = False
        self._wanted = False
        self._closed = threading.Event()
        self._spare: TrainerHandle | None = None
        self._patience = _FIRST_RETRY_SECONDS
        self._no_trainer: str | None = None
        self._first = True
        self._sight = ServerSight(settings.server_url)
        self._fitness = Fitness(settings.work_dir, settings.min_free_bytes)
        self._machine = MachineWatch(gpu=settings.worker_queue == "gpu")
        threading.Thread(target=self._keep, name="keeper", daemon=True).start()
        threading.Thread(target=self._beat, name="heartbeat", daemon=True).start()

    def shutting_down(self) -> bool:
        """Whether a training should be handed back: the worker ends, or has been killed and left this process behind."""
        return self._worker_shutting_down() or self._terminated or os.getppid() != self._parent

    def on_terminate(self, _signal: int, _frame: FrameType | None) -> None:
        """A signal handler: this process alone, or all of the worker's, should end."""
        self._terminated = True

    def directory(self, run_id: str, attempt: int) -> Path:
        """Where an attempt keeps its files; named after this process, so that what a killed one leaves behind is found."""
        return self.settings.work_dir / f"{os.getpid()}-{run_id}-{attempt}"

    @property
    def trouble(self) -> str | None:
        """Why no run is taken up here now; None where one would be."""
        return self._no_trainer or self._fitness.trouble

    def take_trainer(self) -> TrainerHandle:
        """The trainer process that waits, once it is ready for a job; `put_back` or `give_back` must follow.

        Raises:
            UnfitError: no run should be taken up here now: the disk is full, or no trainer starts.
        """
        self._fitness.look()
        deadline = time.monotonic() + _TRAINER_PATIENCE_SECONDS
        with self._condition:
            self._wanted, self._no_trainer = True, None
            self._condition.notify_all()
            try:
                while self._spare is None or not (self._spare.alive and self._spare.ready):
                    if self._no_trainer is not None:
                        raise UnfitError(self._no_trainer)
                    if self.shutting_down() or time.monotonic() > deadline:
                        raise UnfitError("no trainer process was ready in time")
                    self._condition.wait(_READY_POLL_SECONDS)
                spare, self._spare = self._spare, None
                self._busy = True
                return spare
            finally:
                self._wanted = False

    def put_back(self, trainer: TrainerHandle) -> None:
        """The trainer was not needed after all, and waits on."""
        with self._condition:
            self._busy, self._spare = False, trainer

    def give_back(self) -> None:
        """The training has ended: keep another process ready."""
        with self._condition:
            self._busy = False
            self._condition.notify_all()

    def rest(self, fault: str) -> None:
        """Something here has failed: take no run for a while."""
        self._fitness.rest(fault, self.shutting_down)

    def well(self) -> None:
        """An attempt went as it should."""
        self._fitness.well()

    def close(self) -> None:
        """The process ends: so does the trainer that waits, and there are no more heartbeats."""
        self._closed.set()
        with self._condition:
            if self._spare is not None:
                self._spare.close()
                self._spare = None

    def _keep(self) -> None:
        """Linux ends a trainer with the thread that started it, so they are all started on this one."""
        while not self._closed.is_set():
            with self._condition:
                died = self._bury_spare()
                if self._spare is not None and self._spare.ready:
                    self._no_trainer, self._patience = None, _FIRST_RETRY_SECONDS
                if self._spare is None and (self._wanted or not (self._busy or died or self.shutting_down())):
                    died = not self._start_spare()
                if self._alone() and not self._busy:
                    self._leave()
                self._condition.wait(self._patience if died else _TICK_SECONDS)

    def _start_spare(self) -> bool:
        """Whether a trainer could be started: a machine may be out of processes, memory or files for a while."""
        try:
            self._spare = TrainerHandle()
        except OSError as error:
            self._be_patient(f"no trainer can be started: {error}")
            return False
        self._condition.notify_all()
        return True

    def _bury_spare(self) -> bool:
        """Whether the waiting trainer has died; another one is tried after a while that doubles each time."""
        if self._spare is None or self._spare.alive:
            return False
        self._spare.close()
        cause = self._spare.cause_of_death()
        self._spare = None
        self._be_patient(f"no trainer is ready. {cause}")
        return True

    def _be_patient(self, reason: str) -> None:
        if self.shutting_down():
            # A trainer that ends with the worker ends as it should.
            return
        self._no_trainer = reason[:_TROUBLE_CHARACTERS]
        logger.error("%s The next trial is in %g s.", reason, self._patience)
        self._condition.notify_all()
        self._patience = min(2 * self._patience, _LAST_RETRY_SECONDS)

    def _alone(self) -> bool:
        """Whether the worker was killed and left this process behind, or this process was told to end and the worker not."""
        return os.getppid() != self._parent or (self._terminated and not self._worker_shutting_down())

    def _leave(self) -> None:
        if self._spare is not None:
            self._spare.close()
        os._exit(1)

    def _beat(self) -> None:
        while not self._closed.wait(HEARTBEAT_SECONDS if self._beaten() else _TICK_SECONDS):
            pass

    def _beaten(self) -> bool:
        """Whether the server has heard that this worker is there."""
        trouble = self.trouble
        self._fitness.say(trouble)
        try:
            answer = self.client.heartbeat(
                self.name, self.settings.worker_queue, trouble, first=self._first, machine=self._machine.look()
            )
            self._first = False
            if answer.drain and not self._draining:
                self._draining = True
                os.kill(self._parent, DRAIN_SIGNAL)
            # For who watches over this worker without asking the server, as a container's health check does.
            (self.settings.work_dir / HEARTBEAT_FILE).touch()
        except ServerError as error:
            self._sight.lost(error)
            return False
        except OSError as error:
            logger.warning("heartbeat: %s", error)
        self._sight.found()
        return True


def remove_leftovers(work_dir: Path) -> None:
    """Remove what killed processes of this machine have left: their runs go on from their checkpoints."""
    if not work_dir.is_dir():
        return
    for directory in work_dir.iterdir():
        pid, _, rest = directory.name.partition("-")
        if rest and pid.isdigit() and not _exists(int(pid)):
            shutil.rmtree(directory, ignore_errors=True)


def _exists(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
