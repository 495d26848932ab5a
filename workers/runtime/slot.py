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
from workers.runtime.nursery import Nursery
from workers.runtime.settings import WorkerSettings
from workers.runtime.sight import ServerSight
from workers.runtime.trainer_handle import TrainerHandle

logger = logging.getLogger(__name__)

_TICK_SECONDS = 0.5
_READY_POLL_SECONDS = 0.05
# The server takes 10,000.
_TROUBLE_CHARACTERS = 2_000
# Between two trials to keep trainers at hand, where the process that they come from dies on its own.
_FIRST_RETRY_SECONDS = 1.0
_LAST_RETRY_SECONDS = 60.0
# Imports take seconds; on a fresh checkout the simulation's kernels are compiled first, which takes a minute.
_TRAINER_PATIENCE_SECONDS = 300.0


class Slot:
    """A place in which one training at a time runs. Its keeper thread lives as long as the process.

    Importing PyTorch and numba takes seconds, more than a person wants to wait for the first point of a curve: so trainers
    are forked from a process that has done it.

    Args:
        settings: of the worker.
        number: of this process among the worker's, from 0.
        shutting_down: whether the worker has been asked to end.
        door: to the nursery, a descriptor.
    """

    def __init__(self, settings: WorkerSettings, number: int, shutting_down: Callable[[], bool], door: int) -> None:
        self.settings = settings
        self.name = settings.name(number)
        self.client = ServerClient(settings.server_url, settings.worker_token.get_secret_value())
        self._parent = os.getppid()
        self._worker_shutting_down = shutting_down
        self._door = door
        self._condition = threading.Condition()
        self._terminated = False
        self._draining = False
        self._busy = False
        self._wanted = False
        self._closed = threading.Event()
        self._nursery: Nursery | None = None
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
        """A trainer process that waits for its job; `give_back` must follow.

        Raises:
            UnfitError: no run should be taken up here now: the disk is full, or no trainer starts.
        """
        self._fitness.look()
        nursery = self._ready_nursery()
        try:
            trainer = nursery.trainer()
        except OSError as error:
            raise UnfitError(f"no trainer can be started: {error}") from error
        self._busy = True
        return trainer

    def _ready_nursery(self) -> Nursery:
        deadline = time.monotonic() + _TRAINER_PATIENCE_SECONDS
        with self._condition:
            self._wanted, self._no_trainer = True, None
            self._condition.notify_all()
            try:
                while self._nursery is None or not (self._nursery.alive and self._nursery.ready):
                    if self._no_trainer is not None:
                        raise UnfitError(self._no_trainer)
                    if self.shutting_down() or time.monotonic() > deadline:
                        raise UnfitError("no trainer process was ready in time")
                    self._condition.wait(_READY_POLL_SECONDS)
                return self._nursery
            finally:
                self._wanted = False

    def give_back(self, trainer: TrainerHandle) -> None:
        """The trainer has done its job, or was not needed after all."""
        trainer.close()
        self._busy = False

    def rest(self, fault: str) -> None:
        """Something here has failed: take no run for a while."""
        self._fitness.rest(fault, self.shutting_down)

    def well(self) -> None:
        """An attempt went as it should."""
        self._fitness.well()

    def close(self) -> None:
        """The process ends: so do its trainers, and there are no more heartbeats."""
        self._closed.set()
        with self._condition:
            self._close_nursery()

    def _keep(self) -> None:
        """Look after the connection to the nursery, and after the worker."""
        while not self._closed.is_set():
            with self._condition:
                died = self._bury_nursery()
                if self._nursery is not None and self._nursery.ready:
                    self._no_trainer, self._patience = None, _FIRST_RETRY_SECONDS
                if self._nursery is None and self._may_start(died=died):
                    died = not self._come_to_nursery()
                if self._alone() and not self._busy:
                    self._leave()
                self._condition.wait(self._patience if died else _TICK_SECONDS)

    def _may_start(self, *, died: bool) -> bool:
        return not self._closed.is_set() and (self._wanted or not (died or self.shutting_down()))

    def _come_to_nursery(self) -> bool:
        """Whether that could be tried: a machine may be out of memory or files for a while."""
        try:
            self._nursery = Nursery(self._door)
        except OSError as error:
            self._be_patient(f"no trainer can be started: {error}")
            return False
        self._condition.notify_all()
        return True

    def _bury_nursery(self) -> bool:
        """Whether it has died; whether there is another is looked at after a while that doubles each time."""
        if self._nursery is None or self._nursery.alive:
            return False
        self._nursery.close()
        cause = self._nursery.cause_of_death()
        self._nursery = None
        self._be_patient(f"no trainer is ready. {cause}")
        return True

    def _close_nursery(self) -> None:
        if self._nursery is not None:
            self._nursery.close()
            self._nursery = None

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
        self._close_nursery()
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
