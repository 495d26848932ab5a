"""Where checkpoint archives lie: a directory or any fsspec store, under names that the service generates."""

import hashlib
from collections.abc import AsyncIterable, Iterator
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import IO, Any, cast

import fsspec
from starlette.concurrency import run_in_threadpool

from server.errors import CorruptUploadError, NotFoundError, TooLargeError

_BLOCK = 256 * 1024
_SUFFIX = ".zip"


@dataclass(frozen=True)
class StoredFile:
    """An archive that is complete in the store; `sha256` in lower-case hexadecimal, `size` in bytes."""

    id: str
    size: int
    sha256: str


class FileStore:
    """Archives by id. A file counts only once a row names it, so a torn upload is never read; `keep_only` sweeps it away."""

    def __init__(self, url: str, max_bytes: int) -> None:
        self._filesystem, self._root = fsspec.core.url_to_fs(url)
        self._max_bytes = max_bytes
        self._filesystem.makedirs(self._root, exist_ok=True)

    async def write(self, identifier: str, stream: AsyncIterable[bytes], sha256: str | None = None) -> StoredFile:
        """Store what `stream` brings; nothing is left where that fails.

        Raises:
            TooLargeError: more bytes came than the store accepts.
            CorruptUploadError: the bytes' SHA-256 is not `sha256`.
        """
        path = self._path(identifier)
        digest = hashlib.sha256()
        size = 0
        try:
            file = cast("IO[bytes]", await run_in_threadpool(self._filesystem.open, path, "wb"))
            try:
                async for block in stream:
                    size += len(block)
                    if size > self._max_bytes:
                        raise TooLargeError(
                            f"The file is larger than {self._max_bytes} bytes (MAPLESS_MAX_CHECKPOINT_BYTES)."
                        )
                    digest.update(block)
                    await run_in_threadpool(file.write, block)
            finally:
                await run_in_threadpool(file.close)
            if sha256 is not None and digest.hexdigest() != sha256.lower():
                raise CorruptUploadError("What arrived does not have the SHA-256 that was announced: send it again.")
        except BaseException:
            await run_in_threadpool(self.delete, identifier)
            raise
        return StoredFile(identifier, size, digest.hexdigest())

    def read(self, identifier: str) -> Iterator[bytes]:
        """The archive's bytes, block by block.

        Raises:
            NotFoundError: at once, if the store has no such archive.
        """
        try:
            file = cast("IO[bytes]", self._filesystem.open(self._path(identifier), "rb"))
        except FileNotFoundError as error:
            raise NotFoundError(f"The archive of checkpoint {identifier} is gone from the store.") from error
        return _blocks(file)

    def delete(self, identifier: str) -> None:
        """Remove an archive; one that is not there is none to remove."""
        path = self._path(identifier)
        if self._filesystem.exists(path):
            self._filesystem.rm_file(path)

    def ids(self) -> set[str]:
        """The ids of all archives in the store."""
        self._filesystem.invalidate_cache()
        paths = cast("list[str]", self._filesystem.ls(self._root, detail=False))
        return {PurePosixPath(path).stem for path in paths if path.endswith(_SUFFIX)}

    def keep_only(self, known: set[str]) -> int:
        """Remove what no row names (an upload cut short by a crash); returns how many. Only while no upload runs."""
        orphans = self.ids() - known
        for identifier in orphans:
            self.delete(identifier)
        return len(orphans)

    def _path(self, identifier: str) -> str:
        # Ids are generated; this holds the line should one ever come from outside.
        if not identifier.isalnum():
            raise NotFoundError.of("checkpoint", identifier)
        return f"{self._root}/{identifier}{_SUFFIX}"


def _blocks(file: Any) -> Iterator[bytes]:
    with file:
        while block := file.read(_BLOCK):
            yield block
