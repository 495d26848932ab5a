"""What came out of jobs: files by name in a directory that never grows beyond its bound."""

import os
import tempfile
import time
from pathlib import Path

_TORN = ".part"
# What nobody has looked at yet counts as looked at so long ago: it goes before everything that somebody has.
_UNSEEN_SECONDS = 20 * 365 * 86_400.0
# Of the bound, what nobody has looked at yet may take.
_UNSEEN_SHARE = 0.25


class ResultStore:
    """Recordings and bundles, the ones that were looked at longest ago going first.

    The newest of all stays, whatever its size. What was made ahead, and was not looked at yet, goes before all others, and
    takes a quarter of the bound at most. Thread-safe.

    Args:
        directory: may be removed at any time; it is made where it is missing.
        max_bytes: of all files together.
    """

    def __init__(self, directory: Path, max_bytes: int) -> None:
        self._directory = directory
        self._max_bytes = max_bytes

    def find(self, name: str) -> Path | None:
        """A file that is kept, marked as looked at; None where there is none."""
        path = self._directory / name
        try:
            os.utime(path)
        except OSError:
            return None
        return path

    def peek(self, name: str) -> Path | None:
        """`find`, but it is not marked as looked at."""
        path = self._directory / name
        return path if path.exists() else None

    def begin(self) -> Path:
        """A new empty file in the directory, to write to and then `keep`."""
        self._directory.mkdir(parents=True, exist_ok=True)
        descriptor, path = tempfile.mkstemp(suffix=_TORN, dir=self._directory)
        os.close(descriptor)
        return Path(path)

    def keep(self, torn: Path, name: str, *, ahead: bool = False) -> None:
        """What was written goes by its name from now on; `ahead`: nobody has asked for it yet."""
        path = self._directory / name
        if ahead:
            made = time.time() - _UNSEEN_SECONDS
            os.utime(torn, (made, made))
        torn.replace(path)
        self._forget_old(None if ahead else path)

    def forget(self, prefix: str) -> None:
        """Remove all whose names begin so; what is open is read to its end."""
        for file in self._directory.glob(f"{prefix}*"):
            file.unlink(missing_ok=True)

    def _forget_old(self, newest: Path | None) -> None:
        files = [(file, file.stat()) for file in self._directory.iterdir() if not file.name.endswith(_TORN)]
        total = 0 if newest is None else newest.stat().st_size
        unseen, seen_since = 0, time.time() - 0.5 * _UNSEEN_SECONDS
        for file, status in sorted(files, key=lambda each: each[1].st_mtime, reverse=True):
            if file != newest:
                total += status.st_size
                unseen += status.st_size if status.st_mtime < seen_since else 0
                if total > self._max_bytes or unseen > _UNSEEN_SHARE * self._max_bytes:
                    file.unlink(missing_ok=True)
