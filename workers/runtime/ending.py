"""How a worker comes to its end by itself: drained, it finishes its runs and takes no more; idle for long enough, it leaves.

Celery's warm shutdown is the whole of it: no message is taken any more, the process ends with its last task. What makes a
task hand its run back early (`worker_shutting_down`, sent for SIGTERM) is left out here, and works still while runs finish.
"""

import logging
import os
import signal
import threading
import time
from pathlib import Path
from types import FrameType

from celery.worker import state

from workers.protocol import HEARTBEAT_SECONDS
from workers.runtime.fitness import HEARTBEAT_FILE

logger = logging.getLogger(__name__)

DRAIN_SIGNAL = signal.SIGUSR1
"""Sent to a worker's main process: finish what is under way, take nothing more, end."""

_TICK_SECONDS = 0.5
# A server that was not reached for longer cannot have had work.
_SILENCE_SECONDS = 3 * HEARTBEAT_SECONDS


def drain_on_signal() -> None:
    """Let the worker's main process obey `DRAIN_SIGNAL`; once Celery has put its own handlers in place."""
    signal.signal(DRAIN_SIGNAL, _drain)


def leave_when_idle(work_dir: Path, seconds: float) -> None:
    """Drain this worker, in its main process, once it had nothing to do for so long while the server was there."""
    threading.Thread(target=_watch, args=(work_dir / HEARTBEAT_FILE, seconds), name="until idle", daemon=True).start()


def _drain(_signal: int, _frame: FrameType | None) -> None:
    # Not by the logger, which this handler may have interrupted.
    os.write(2, b"Draining: the runs under way are finished, no more are taken up.\n")
    state.should_stop = os.EX_OK


def _watch(heartbeat: Path, seconds: float) -> None:
    idle_since = time.monotonic()
    while time.monotonic() - idle_since < seconds:
        time.sleep(_TICK_SECONDS)
        if state.active_requests or state.reserved_requests or not _reached(heartbeat):
            idle_since = time.monotonic()
    logger.info("Nothing to do for %g s: this worker ends.", seconds)
    os.kill(os.getpid(), DRAIN_SIGNAL)


def _reached(heartbeat: Path) -> bool:
    """Whether the server was reached lately: what is not heard of cannot be said to be nothing."""
    try:
        return time.time() - heartbeat.stat().st_mtime < _SILENCE_SECONDS
    except OSError:
        return False
