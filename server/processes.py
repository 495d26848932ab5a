"""Work that somebody waits for in a process of its own, because it needs torch, which the server never imports."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
"""Of the packages that such processes run."""


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

    Raises:
        ProcessFailedError: it failed.
        ProcessTimeoutError: it took longer.
    """
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    try:
        subprocess.run(
            [sys.executable, "-m", module, *arguments],
            env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=True,
        )
    except subprocess.TimeoutExpired as error:
        raise ProcessTimeoutError from error
    except subprocess.CalledProcessError as error:
        reason = error.stderr.strip().splitlines()[-1:] or [f"exit status {error.returncode}"]
        raise ProcessFailedError(reason[0].removeprefix("mapless: ")) from error
