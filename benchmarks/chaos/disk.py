"""A small disk that can be filled up while others write to it."""

import contextlib
import os
import resource
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import psutil

_BALLAST = "ballast"


class Disk:
    """A file system in memory of its own, mounted at `path`.

    Where mounting is not allowed, the processes that use the directory get a limit of zero bytes a file instead: every write
    to a file fails for them as well, with another number.

    Args:
        path: of the directory, which is made.
        megabytes: it holds.
        users: the processes that write to it, for the second way.
    """

    def __init__(self, path: Path, megabytes: int, users: Callable[[], Sequence[psutil.Process]]) -> None:
        self.path = path
        self._users = users
        path.mkdir(parents=True)
        command = ("mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "mapless-chaos", str(path))
        self.mounted = subprocess.run(command, check=False, capture_output=True).returncode == 0

    def fill(self) -> None:
        """Leave no room."""
        if not self.mounted:
            self._limit(0)
            return
        with (self.path / _BALLAST).open("ab") as ballast, contextlib.suppress(OSError):
            while True:
                # In pieces that shrink: others take the last pages meanwhile.
                free = os.statvfs(self.path)
                os.write(ballast.fileno(), bytes(max(1, min(2**20, free.f_bavail * free.f_frsize))))

    def free(self) -> None:
        """Make room again."""
        if self.mounted:
            (self.path / _BALLAST).unlink(missing_ok=True)
        else:
            self._limit(resource.RLIM_INFINITY)

    def close(self) -> None:
        """Unmount it; what it holds is gone."""
        if self.mounted:
            subprocess.run(("umount", "--lazy", str(self.path)), check=False)

    def _limit(self, limit: int) -> None:
        for process in self._users():
            with contextlib.suppress(psutil.NoSuchProcess):
                _, hard = process.rlimit(psutil.RLIMIT_FSIZE)
                process.rlimit(psutil.RLIMIT_FSIZE, (limit, hard))
