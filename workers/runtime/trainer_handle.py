"""A trainer process as the Celery task sees it: given its job, listened to, asked to stop, killed."""

import logging
import os
import threading
from collections.abc import Callable

from workers.processes import how_it_ended
from workers.runtime.forked_process import ForkedProcess
from workers.runtime.pipe import Control, Job, Order, Report, Sender, reports
from workers.runtime.printed import Printed

logger = logging.getLogger(__name__)


class TrainerHandle:
    """A trainer process in a session of its own, which waits for its one job.

    Args:
        process: that was forked.
        orders, output, reports: descriptors to write its orders to, and to read from what it prints and reports.
    """

    def __init__(self, process: ForkedProcess, orders: int, output: int, reports: int) -> None:
        self._process = process
        self._orders_stream = os.fdopen(orders, "wb")
        self._orders = Sender(self._orders_stream)
        self._orders_lock = threading.Lock()
        self._printed = Printed(os.fdopen(output, "rb"), logger, f"trainer {process.pid}")
        self._reports = os.fdopen(reports, "rb")
        self._on_report: Callable[[Report], None] | None = None
        self._report_thread = threading.Thread(target=self._read_reports, name="trainer reports", daemon=True)
        self._report_thread.start()

    @property
    def pid(self) -> int:
        """Its id, which is its process group's too."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self._process.alive

    def train(self, job: Job, on_report: Callable[[Report], None], on_output: Callable[[str], None]) -> None:
        """Give it its one job; all that it reports, and all lines that it prints, are told in order on threads."""
        self._printed.on_line = on_output
        self._on_report = on_report
        self._send(job)

    def control(self, control: Control) -> None:
        """Tell it what it should know now; one that has ended is told nothing."""
        self._send(control)

    def wait(self, seconds: float) -> bool:
        """Whether it has ended within that time."""
        return self._process.wait(seconds)

    def kill(self) -> None:
        """End it and whatever it has started, at once; of one that has ended it does nothing."""
        self._process.kill()

    def close(self) -> None:
        """Kill it if it still runs, and hear the last of its reports."""
        if self.alive:
            self.kill()
        _ = self._process.status
        self._report_thread.join()
        self._printed.close()
        self._reports.close()
        try:
            self._orders_stream.close()
        except BrokenPipeError:
            return

    def cause_of_death(self) -> str:
        """How it ended and what it printed last; call it after `close`."""
        return self._printed.explains(f"The trainer process {how_it_ended(self._process.status)}.")

    def _send(self, order: Order) -> None:
        with self._orders_lock:
            try:
                self._orders.send(order)
            except (BrokenPipeError, ValueError):
                return  # it has ended, and whoever waits for it notices

    def _read_reports(self) -> None:
        receiver = reports(self._reports)
        while (report := receiver.receive()) is not None:
            if self._on_report is not None:  # it says nothing before it has its job
                self._on_report(report)
