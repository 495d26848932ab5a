"""Processes that must not outlive the one that started them."""

import ctypes
import os
import signal
import sys
from pathlib import Path

_PR_SET_PDEATHSIG = 1
_PR_SET_NAME = 15


def die_with_parent(parent: int) -> None:
    """Linux kills this process when its parent dies, also while a library call holds the interpreter."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def python_path() -> str:
    """PYTHONPATH of a process that is to import these packages, wherever it is started."""
    root = Path(__file__).resolve().parents[1]
    return os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH"))))


def name_this_process(role: str) -> None:
    """So that it is "mapless-trainer" and not "python" in a list of processes; the role in eight bytes at most, on Linux."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_NAME, f"mapless-{role}".encode())


def how_it_ended(status: int) -> str:
    """How a process ended, by its exit status as `subprocess` and `multiprocessing` tell it: "was killed by ..."."""
    if status >= 0:
        return f"ended with status {status}"
    try:
        name = f" ({signal.Signals(-status).name})"
    except ValueError:
        name = ""
    cause = ": out of memory, perhaps" if status == -signal.SIGKILL else ""
    return f"was killed by signal {-status}{name}{cause}"


def usable_cores() -> int:
    """The processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
