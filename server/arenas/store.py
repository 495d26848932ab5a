"""Imported arenas on disk: one file each, named by the hash of its geometry; the service and `mapless arena` share it."""

import os
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from server.errors import ConflictError, NotFoundError
from sim.config import ArenaFile

MAX_ARENAS = 1000
"""More than anybody looks through; an upload beyond it is refused."""

_SUFFIX = ".json"
_HASH = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class StoredArena:
    """An imported arena, and when it came (seconds since the epoch)."""

    document: ArenaFile
    imported_at: float


class ArenaStore:
    """Arenas by hash, in our own format (JSON is YAML). Files appear whole or not at all."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        # By hash, with when its file was changed last: no more than MAX_ARENAS at a time are there.
        self._names: dict[str, tuple[int, str]] = {}

    def add(self, document: ArenaFile) -> str:
        """Keep an arena; the same geometry again keeps its first name.

        Returns:
            Its hash.

        Raises:
            ConflictError: there are too many.
        """
        sha256 = document.sha256
        path = self._path(sha256)
        if path.exists():
            return sha256
        if len(self._files()) >= MAX_ARENAS:
            raise ConflictError(f"There are {MAX_ARENAS} imported arenas already: delete some first.")
        self._directory.mkdir(parents=True, exist_ok=True)
        descriptor, name = tempfile.mkstemp(dir=self._directory, suffix=".part")
        try:
            with os.fdopen(descriptor, "w", encoding="utf-8") as file:
                file.write(document.model_dump_json(exclude_none=True))
            Path(name).replace(path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
        return sha256

    def get(self, sha256: str) -> StoredArena:
        """The arena of a hash.

        Raises:
            NotFoundError: there is none, or its file was changed and is another place now.
        """
        path = self._path(sha256)
        try:
            document = ArenaFile.model_validate_json(path.read_bytes())
            imported_at = path.stat().st_mtime
        except (OSError, ValidationError) as error:
            raise NotFoundError.of("imported arena", sha256[:12]) from error
        if document.sha256 != sha256:
            raise NotFoundError.of("imported arena", sha256[:12])
        return StoredArena(document, imported_at)

    @property
    def changed_at(self) -> int:
        """When an arena came or went last, in nanoseconds of the file system's clock; 0 before the first."""
        try:
            return self._directory.stat().st_mtime_ns
        except FileNotFoundError:
            return 0

    def name(self, sha256: str) -> str | None:
        """What the arena of a hash is called, read once while its file stays as it is; None where there is none."""
        try:
            changed = self._path(sha256).stat().st_mtime_ns
        except (OSError, NotFoundError):
            return None
        known = self._names.get(sha256)
        if known is None or known[0] != changed:
            try:
                known = changed, self.get(sha256).document.name
            except NotFoundError:
                return None
            self._names[sha256] = known
        return known[1]

    def all(self) -> list[StoredArena]:
        """Every arena, by name; files that are none are passed over."""
        found = []
        for path in self._files():
            try:
                found.append(self.get(path.stem))
            except NotFoundError:
                continue
        return sorted(found, key=lambda stored: (stored.document.name.lower(), stored.imported_at))

    def find(self, beginning: str) -> StoredArena:
        """The arena whose name is `beginning`, or whose hash starts with it, as a person would type it.

        Raises:
            NotFoundError: there is none, or more than one.
        """
        found = [
            stored
            for stored in self.all()
            if stored.document.name == beginning or stored.document.sha256.startswith(beginning.lower())
        ]
        if len(found) != 1:
            raise NotFoundError(f"{'No' if not found else 'More than one'} imported arena is called {beginning!r}.")
        return found[0]

    def delete(self, sha256: str) -> None:
        """Remove an arena.

        Raises:
            NotFoundError: there is none.
        """
        try:
            self._path(sha256).unlink()
        except FileNotFoundError as error:
            raise NotFoundError.of("imported arena", sha256[:12]) from error

    def _files(self) -> list[Path]:
        return [path for path in self._directory.glob(f"*{_SUFFIX}") if _HASH.fullmatch(path.stem)]

    def _path(self, sha256: str) -> Path:
        # Only a hash ever becomes a part of a path.
        if not _HASH.fullmatch(sha256):
            raise NotFoundError.of("imported arena", sha256[:12])
        return self._directory / f"{sha256}{_SUFFIX}"
