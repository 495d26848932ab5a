"""A process that runs for as long as this one does, and is started again where it dies."""

import logging
import os
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

from workers.runtime.supervised import SUPERVISED

logger = logging.getLogger(__name__)

_ROOT = Path(__file__).resolve().parents[2]
_FIRST_RESTART_SECONDS = 0.5
_LAST_RESTART_SECONDS = 30.0
# One that ran for this long has not died of what it died of before.
_STABLE_SECONDS = 60.0


class Companion:
    """`python COMMAND`, which ends in order when this process ends, however that ends."""

    def __init__(self, command: Sequence[str]) -> None:
        self._command = command
        self._process = self._start()

    def keep_running(self) -> None:
        """Start it again wherever it dies, from a thread; once this process has forked what it forks at its start."""
        threading.Thread(target=self._keep, name="companion", daemon=True).start()

    def _start(self) -> "subprocess.Popen[bytes]":
        path = os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH"))))
        return subprocess.Popen(
            [sys.executable, *self._command],
            # It hears of this process's end by the end of its input.
            stdin=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": path, SUPERVISED: "1"},
        )

    def _keep(self) -> None:
        patience = _FIRST_RESTART_SECONDS
        began = time.monotonic()
        while True:
            code = self._process.wait()
            if time.monotonic() - began > _STABLE_SECONDS:
                patience = _FIRST_RESTART_SECONDS
            logger.error("%s ended (status %d) and is started again in %g s", " ".join(self._command), code, patience)
            time.sleep(patience)
            patience = min(2 * patience, _LAST_RESTART_SECONDS)
            began = time.monotonic()
            self._process = self._start()
