"""Lets a process that a supervisor started end in order when the supervisor dies, however that dies."""

import os
import signal
import threading

SUPERVISED = "MAPLESS_SUPERVISED"
"""Environment variable: set where a supervisor holds the other end of standard input."""


def end_with_supervisor() -> None:
    """Where a supervisor started this process: ask it to end (SIGTERM) once its standard input closes."""
    if os.environ.pop(SUPERVISED, None) is None:
        return

    def watch() -> None:
        while os.read(0, 1024):
            pass
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, name="supervisor watch", daemon=True).start()
