"""The trainer process as the Celery task sees it: started, given a job, listened to, asked to stop, killed."""

import logging
import os
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import IO

from workers.processes import how_it_ended
from workers.runtime.pipe import Control, Job, Order, Ready, Report, Sender, reports

logger = logging.getLogger(__name__)

_ROOT = Path(__file__).resolve().parents[2]
# What a crash is explained with.
_STDERR_LINES = 15
# One thread a process: seeds train side by side, one a core, and small networks gain nothing from more.
_ENVIRONMENT = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}


class TrainerHandle:
    """A trainer process in a session of its own. It imports what it needs at once and waits for a job.

    Start it from a thread that lives as long as the worker: Linux ends the process when the thread that started it ends.
    """

    def __init__(self) -> None:
        read_end, write_end = os.pipe()
        path = os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH"))))
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "workers.runtime.trainer_process", str(write_end), str(os.getpid())],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                pass_fds=(write_end,),
                start_new_session=True,
                env={**os.environ, **_ENVIRONMENT, "PYTHONPATH": path},
            )
        except BaseException:
            os.close(read_end)
            raise
        finally:
            os.close(write_end)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._reports = os.fdopen(read_end, "rb")
        self._orders = Sender(self._process.stdin)
        self._orders_lock = threading.Lock()
        self._output: deque[str] = deque(maxlen=_STDERR_LINES)
        self._on_output: Callable[[str], None] | None = None
        self._output_thread = threading.Thread(
            target=self._read_output, args=(self._process.stdout,), name="trainer output", daemon=True
        )
        self._output_thread.start()
        self._ready = threading.Event()
        self._on_report: Callable[[Report], None] | None = None
        self._report_thread = threading.Thread(target=self._read_reports, name="trainer reports", daemon=True)
        self._report_thread.start()

    @property
    def pid(self) -> int:
        """Process id, which is its process group too."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None

    @property
    def ready(self) -> bool:
        """Whether it has come as far as to wait for its job."""
        return self._ready.is_set()

    def train(self, job: Job, on_report: Callable[[Report], None], on_output: Callable[[str], None]) -> None:
        """Give it its one job; all that it reports, and all lines that it prints, are told in order on threads."""
        self._on_output = on_output
        self._on_report = on_report
        self._send(job)

    def control(self, control: Control) -> None:
        """Tell it what it should know now; one that has ended is told nothing."""
        self._send(control)

    def wait(self, seconds: float) -> bool:
        """Whether it has ended within that time."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    def kill(self) -> None:
        """End it and whatever it has started, at once."""
        # Only while it is ours to name: its number may belong to somebody else once it has been waited for.
        if self.alive:
            os.killpg(self._process.pid, signal.SIGKILL)

    def close(self) -> None:
        """Kill it if it still runs, and hear the last of its reports."""
        self.kill()
        self._process.wait()
        self._report_thread.join()
        self._output_thread.join()
        self._reports.close()
        for stream in (self._process.stdin, self._process.stdout):
            assert stream is not None
            try:
                stream.close()
            except BrokenPipeError:
                continue

    def cause_of_death(self) -> str:
        """How it ended and what it printed last; call it after `close`."""
        how = how_it_ended(self._process.returncode)
        tail = "\n".join(self._output)
        return f"The trainer process {how}." + (f" It printed last:\n{tail}" if tail else "")

    def _send(self, order: Order) -> None:
        with self._orders_lock:
            try:
                self._orders.send(order)
            except (BrokenPipeError, ValueError):
                return  # it has ended, and whoever waits for it notices

    def _read_reports(self) -> None:
        receiver = reports(self._reports)
        while (report := receiver.receive()) is not None:
            if isinstance(report, Ready):
                self._ready.set()
            elif self._on_report is not None:  # it says nothing else before it has its job
                self._on_report(report)

    def _read_output(self, stream: IO[bytes]) -> None:
        for line in stream:
            text = line.decode(errors="replace").replace("\0", "").rstrip()
            self._output.append(text)
            if self._on_output is not None:
                self._on_output(text)
            logger.info("trainer %d: %s", self._process.pid, text)
