"""A process that runs for as long as this one does, and is started again where it dies."""

import logging
import subprocess
import threading
import time
from collections.abc import Callable

from workers.processes import how_it_ended
from workers.runtime.printed import Printed

logger = logging.getLogger(__name__)

_FIRST_RESTART_SECONDS = 0.5
_LAST_RESTART_SECONDS = 30.0
# One that ran for this long has not died of what it died of before.
_STABLE_SECONDS = 60.0


class Companion:
    """A process that is started at once, and looked after once this one has forked what it forks at its start.

    Args:
        name: what it is called in the log, as "the trainers' nursery".
        start: starts it, or raises OSError where the machine can start none now. Where its output is a pipe, what it prints
            goes into this process's log.
        on_trouble: is told, in a sentence for people, that it can't be started, or has ended soon after it was begun again.
    """

    def __init__(
        self, name: str, start: Callable[[], "subprocess.Popen[bytes]"], on_trouble: Callable[[str], None] | None = None
    ) -> None:
        self._name = name
        self._start = start
        self._on_trouble = on_trouble
        self._closed = threading.Event()
        self._fault = ""
        self._process = self._started()

    def keep_running(self) -> None:
        """Start it again wherever it dies, from a thread that lasts as long as this process."""
        threading.Thread(target=self._keep, name=self._name, daemon=True).start()

    def close(self) -> None:
        """End it for good, without a word."""
        self._closed.set()
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def _started(self) -> "subprocess.Popen[bytes] | None":
        try:
            return self._start()
        except OSError as error:
            self._fault = f"No process can be started: {error}"
            return None

    def _keep(self) -> None:
        patience = _FIRST_RESTART_SECONDS
        while not self._closed.is_set():
            began = time.monotonic()
            how = self._until_it_ends()
            if self._closed.is_set():
                return
            if time.monotonic() - began > _STABLE_SECONDS:
                patience = _FIRST_RESTART_SECONDS
            logger.error("%s: %s It is started again in %g s.", self._name, how, patience)
            if self._on_trouble is not None and (self._process is None or patience > _FIRST_RESTART_SECONDS):
                self._on_trouble(how)
            if self._closed.wait(patience):
                return
            patience = min(2 * patience, _LAST_RESTART_SECONDS)
            self._process = self._started()

    def _until_it_ends(self) -> str:
        if self._process is None:
            return self._fault
        if self._process.stdout is None:
            return f"It {how_it_ended(self._process.wait())}."
        printed = Printed(self._process.stdout, logger, f"{self._name} {self._process.pid}")
        status = self._process.wait()
        printed.close()
        return printed.explains(f"It {how_it_ended(status)}.")
