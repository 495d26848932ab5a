"""Whether this worker can take up a run now: looked at before each claim, so that a sick machine leaves runs to others."""

import logging
import os
import shutil
import stat
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

from workers.errors import UnfitError
from workers.wording import counted

logger = logging.getLogger(__name__)

# After a fault of this machine; doubled from fault to fault until an attempt goes well.
_FIRST_REST_SECONDS = 1.0
_LAST_REST_SECONDS = 60.0
# A worker that is to end does not rest to the end of it.
_LOOK_UP_SECONDS = 0.2
_PROBE_BYTES = 4_096
_PRIVATE = 0o700

HEARTBEAT_FILE = "heartbeat"
"""In the work folder; touched whenever the server has heard that this worker is there."""


class Fitness:
    """What is known of this worker's machine. Thread-safe.

    Args:
        work_dir: where runs keep their files.
        min_free_bytes: of the file system that it is on, below which no run is taken up.
    """

    def __init__(self, work_dir: Path, min_free_bytes: int) -> None:
        self._work_dir = work_dir
        self._min_free_bytes = min_free_bytes
        self._lock = threading.Lock()
        self._rest_seconds = _FIRST_REST_SECONDS
        self._fault: str | None = None
        self._said: str | None = None

    @property
    def trouble(self) -> str | None:
        """Why no run is taken up now; None where one would be."""
        return self._fault or self._disk()

    def look(self) -> None:
        """Before a claim.

        Raises:
            UnfitError: this machine would not bring a run to its end; the message says why.
        """
        reason = self._disk()
        if reason is not None:
            raise UnfitError(reason)

    def rest(self, fault: str, ended: Callable[[], bool]) -> None:
        """Something here has failed: take no run for a while, so that others get them."""
        with self._lock:
            seconds, self._rest_seconds = self._rest_seconds, min(2 * self._rest_seconds, _LAST_REST_SECONDS)
            self._fault = self._said = fault
        logger.warning("This worker takes up no run for %g s: %s", seconds, fault)
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline and not ended():
            time.sleep(_LOOK_UP_SECONDS)
        with self._lock:
            self._fault = None

    def well(self) -> None:
        """An attempt went as it should: the next fault is the first again."""
        with self._lock:
            self._rest_seconds = _FIRST_REST_SECONDS

    def say(self, trouble: str | None) -> None:
        """Tell the log, once, what has changed."""
        with self._lock:
            before, self._said = self._said, trouble
        if trouble is not None and trouble != before:
            logger.warning("This worker takes up no run: %s", trouble)
        elif trouble is None and before is not None:
            logger.info("This worker takes up runs again.")

    def _disk(self) -> str | None:
        """What is wrong with the folder for runs' files; None where it can be used."""
        try:
            free = shutil.disk_usage(self._work_dir).free
            if free < self._min_free_bytes:
                return (
                    f"{self._work_dir} has {counted(free / 2**20)} MiB free, less than "
                    f"{counted(self._min_free_bytes / 2**20)}: make room there, "
                    "or choose another place (MAPLESS_WORK_DIR, MAPLESS_MIN_FREE_BYTES)"
                )
            with tempfile.TemporaryFile(dir=self._work_dir) as probe:
                probe.write(bytes(_PROBE_BYTES))
                probe.flush()
        except OSError as error:
            return f"{self._work_dir} can't be written to ({error.strerror}): mend it, or choose another (MAPLESS_WORK_DIR)"
        return None


def make_private(directory: Path) -> None:
    """Make the folder for runs' files, this user's alone; one that is there already must be safe from other users.

    Raises:
        UnfitError: it can't be made, or others could exchange what is kept there.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True, mode=_PRIVATE)
        status = directory.stat()
    except OSError as error:
        raise UnfitError(
            f"The work folder {directory} can't be used ({error.strerror}): choose another one (MAPLESS_WORK_DIR)."
        ) from error
    writable = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH) and not status.st_mode & stat.S_ISVTX
    if status.st_uid not in (os.geteuid(), 0) or writable:
        raise UnfitError(
            f"Other users of this machine can exchange what is kept in {directory}: choose another work folder "
            "(MAPLESS_WORK_DIR), or take their rights away."
        )
