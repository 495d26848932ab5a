"""Work that somebody waits for in a process of its own, because it needs torch, which the server never imports."""

import os
import subprocess
import sys
import time
from pathlib import Path

from server.abandoned import stop_if_abandoned

ROOT = Path(__file__).resolve().parents[1]
"""Of the packages that such processes run."""


# Between two looks at whether somebody still waits.
_LOOK_SECONDS = 0.2


class ProcessFailedError(Exception):
    """The process ended with an error; its last words are the message."""


class ProcessTimeoutError(Exception):
    """The process took too long, and was ended."""


def run_module(module: str, *arguments: str, timeout: float) -> None:
    """`python -m module arguments ...` on one thread, until it has ended.

    Args:
        module: to run.
        arguments: of its command line.
        timeout: seconds.

    On a thread of anyio's that works for a request, it is ended when the request is cancelled.

    Raises:
        ProcessFailedError: it failed.
        ProcessTimeoutError: it took longer.
    """
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    deadline = time.monotonic() + timeout
    with subprocess.Popen(
        [sys.executable, "-m", module, *arguments],
        env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": path},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            while (words := _last_words(process)) is None:
                if time.monotonic() > deadline:
                    raise ProcessTimeoutError
                stop_if_abandoned()
        finally:
            process.kill()
    if process.returncode != 0:
        reason = words.strip().splitlines()[-1:] or [f"exit status {process.returncode}"]
        raise ProcessFailedError(reason[0].removeprefix("mapless: "))


def _last_words(process: "subprocess.Popen[str]") -> str | None:
    """What it said on standard error, once it has ended; None while it goes on."""
    try:
        return process.communicate(timeout=_LOOK_SECONDS)[1]
    except subprocess.TimeoutExpired:
        return None
