"""What came out of jobs: files by name in a directory that never grows beyond its bound."""

import os
import tempfile
from pathlib import Path

_TORN = ".part"


class ResultStore:
    """Recordings and bundles, the ones that were looked at longest ago going first.

    The newest of all stays, whatever its size. Thread-safe.

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

    def begin(self) -> Path:
        """A new empty file in the directory, to write to and then `keep`."""
        self._directory.mkdir(parents=True, exist_ok=True)
        descriptor, path = tempfile.mkstemp(suffix=_TORN, dir=self._directory)
        os.close(descriptor)
        return Path(path)

    def keep(self, torn: Path, name: str) -> None:
        """What was written goes by its name from now on."""
        path = self._directory / name
        torn.replace(path)
        self._forget_old(path)

    def _forget_old(self, newest: Path) -> None:
        files = [(file, file.stat()) for file in self._directory.iterdir() if not file.name.endswith(_TORN)]
        total = newest.stat().st_size
        for file, status in sorted(files, key=lambda each: each[1].st_mtime, reverse=True):
            if file != newest:
                total += status.st_size
                if total > self._max_bytes:
                    file.unlink(missing_ok=True)
