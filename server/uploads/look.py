"""A first look at an ONNX file, in a process of its own: a file of somebody else's never runs in the server's."""

import os
import subprocess
import sys
import threading
from importlib.util import find_spec

from server.errors import BusyError
from sim.config import TaskConfig

_AT_ONCE = threading.BoundedSemaphore(2)
_SECONDS = 90.0
_PATIENCE = 30.0
# What Python needs to start; tokens and addresses of the server's environment are nothing for it.
_ENVIRONMENT = ("HOME", "LANG", "LD_LIBRARY_PATH", "NUMBA_CACHE_DIR", "PATH", "PYTHONPATH", "TMPDIR", "VIRTUAL_ENV")
# The version of the format, with which every ONNX file that anything writes begins.
_FIRST = b"\x08"


def problem_of(graph: bytes, task: TaskConfig) -> str:
    """Why a file can't be the policy of a task; "" where nothing is known to be wrong.

    Where ONNX Runtime is not installed beside the server, only a worker finds out.

    Raises:
        BusyError: others are looked at.
    """
    if not graph.startswith(_FIRST):
        return "this is no ONNX file"
    if find_spec("onnxruntime") is None or find_spec("onnx") is None:
        return ""
    if not _AT_ONCE.acquire(timeout=_PATIENCE):
        raise BusyError("Other policies are being looked at: try again in a moment.")
    try:
        looked = subprocess.run(
            [sys.executable, "-m", "workers.onnx_check"],
            input=task.model_dump_json().encode() + b"\n" + graph,
            capture_output=True,
            timeout=_SECONDS,
            env={name: os.environ[name] for name in _ENVIRONMENT if name in os.environ},
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"ONNX Runtime was not done with it after {_SECONDS:.0f} s"
    finally:
        _AT_ONCE.release()
    if looked.returncode != 0:
        return "ONNX Runtime ended at it, for want of memory or by a fault in the file"
    return looked.stdout.decode(errors="replace")[:1_000]
