"""Processes for jobs, begun by the worker's nursery."""

import contextlib
import threading
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import TypeAlias

from workers.job_protocol import JobOrders
from workers.runtime.forked_process import ForkedProcess
from workers.runtime.jobs.process import Said, Task
from workers.runtime.nursery import Nursery

# Imports take seconds; on a fresh checkout the simulation's kernels are compiled first, which takes a minute.
_PATIENCE_SECONDS = 300.0

Orders: TypeAlias = "Connection[Task | JobOrders, Said]"


class Forks:
    """The nursery as all places of a process have it.

    Args:
        door: to the nursery, a descriptor.
    """

    def __init__(self, door: int) -> None:
        self._door = door
        self._lock = threading.Lock()
        self._nursery: Nursery | None = None

    def begin(self, task: Task) -> tuple[ForkedProcess, Orders]:
        """A process that does the task, and the pipe over which it is told more, and tells.

        Raises:
            OSError: the machine can begin none now, and why.
        """
        nursery = self._reached()
        nursery.until_ready(_PATIENCE_SECONDS)
        ours, theirs = Pipe()
        try:
            with theirs:
                process = nursery.job(theirs)
            with contextlib.suppress(BrokenPipeError):  # it has ended, and whoever waits for it notices
                ours.send(task)
        except BaseException:
            ours.close()
            raise
        return process, ours

    def close(self) -> None:
        """End what was begun."""
        with self._lock:
            if self._nursery is not None:
                self._nursery.close()
                self._nursery = None

    def _reached(self) -> Nursery:
        with self._lock:
            if self._nursery is not None and not self._nursery.alive:
                self._nursery.close()
                self._nursery = None
            if self._nursery is None:
                self._nursery = Nursery(self._door)
            return self._nursery
