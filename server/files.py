"""Where checkpoint archives lie: a directory or any fsspec store, under names that the service generates."""

import hashlib
import os
from collections.abc import AsyncIterable, Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO, Any, TypeVar, TypeVarTuple, cast

import fsspec
from anyio import CapacityLimiter, to_thread
from fsspec.implementations.local import LocalFileSystem

from server.errors import CorruptUploadError, NotFoundError, ServiceError, TooLargeError
from workers.checkpoints import sync_directory

_T = TypeVar("_T")
_Args = TypeVarTuple("_Args")

# Of uploads: a store that takes its time keeps nobody from reading pages.
_THREADS = 4
_BLOCK = 256 * 1024
_SUFFIX = ".zip"
_TORN_SUFFIX = ".part"


class UnusableStoreError(ServiceError):
    """No such kind of store, or its package is not installed."""


@dataclass(frozen=True)
class StoredFile:
    """An archive that is complete in the store; `sha256` in lower-case hexadecimal, `size` in bytes."""

    id: str
    size: int
    sha256: str


class FileStore:
    """Archives by id, each complete: while it is being written it goes by another name.

    What was written is on disk when `write` returns, where the store is a directory; other stores promise that themselves.

    Args:
        url: a directory, or an fsspec URL.
        max_bytes: of one archive.

    Raises:
        UnusableStoreError: the URL's kind of store is not known here.
    """

    def __init__(self, url: str, max_bytes: int) -> None:
        try:
            self._filesystem, self._root = fsspec.core.url_to_fs(url)
        except (ImportError, ValueError) as error:
            raise UnusableStoreError(f"Checkpoints can't be kept at {url} (MAPLESS_FILES_URL): {error}") from error
        self._max_bytes = max_bytes
        self._limiter = CapacityLimiter(_THREADS)
        self._local = isinstance(self._filesystem, LocalFileSystem)
        self._filesystem.makedirs(self._root, exist_ok=True)

    async def write(self, identifier: str, stream: AsyncIterable[bytes], sha256: str | None = None) -> StoredFile:
        """Store what `stream` brings; nothing is left where that fails.

        Raises:
            TooLargeError: more bytes came than the store accepts.
            CorruptUploadError: the bytes' SHA-256 is not `sha256`.
        """
        path = self._path(identifier)
        torn = path + _TORN_SUFFIX
        digest = hashlib.sha256()
        size = 0
        try:
            file = cast("IO[bytes]", await self._on_thread(self._filesystem.open, torn, "wb"))
            try:
                async for block in stream:
                    size += len(block)
                    if size > self._max_bytes:
                        raise TooLargeError(
                            f"The file is larger than {self._max_bytes} bytes (MAPLESS_MAX_CHECKPOINT_BYTES)."
                        )
                    digest.update(block)
                    await self._on_thread(file.write, block)
                await self._on_thread(self._sync, file)
            finally:
                await self._on_thread(file.close)
            if sha256 is not None and digest.hexdigest() != sha256.lower():
                raise CorruptUploadError("What arrived does not have the SHA-256 that was announced: send it again.")
            await self._on_thread(self._filesystem.mv, torn, path)
            await self._on_thread(self._sync_root)
        except BaseException:
            await self._on_thread(self._remove, torn)
            raise
        return StoredFile(identifier, size, digest.hexdigest())

    async def _on_thread(self, work: Callable[[*_Args], _T], *arguments: *_Args) -> _T:
        return await to_thread.run_sync(work, *arguments, limiter=self._limiter)

    def open(self, identifier: str) -> IO[bytes]:
        """The archive as a file to read and seek in; the caller closes it.

        Raises:
            NotFoundError: the store has no such archive.
        """
        try:
            return cast("IO[bytes]", self._filesystem.open(self._path(identifier), "rb"))
        except FileNotFoundError as error:
            raise NotFoundError(f"The archive of checkpoint {identifier} is gone from the store.") from error

    def read(self, identifier: str, start: int = 0) -> Iterator[bytes]:
        """The archive's bytes from `start` on, block by block.

        Raises:
            NotFoundError: at once, if the store has no such archive.
        """
        file = self.open(identifier)
        file.seek(start)
        return _blocks(file)

    def delete(self, identifier: str) -> None:
        """Remove an archive, and what an upload that was cut off left of it; one that is not there is none to remove."""
        path = self._path(identifier)
        self._remove(path)
        self._remove(path + _TORN_SUFFIX)

    def ping(self) -> None:
        """Ask the store for an answer.

        Raises:
            OSError: it is not there.
        """
        self._list()

    def probe(self) -> None:
        """Write, read and remove a small file.

        Raises:
            OSError: the store does not keep what it is given.
        """
        # By the name of a torn upload, which would be removed at the next start.
        path = f"{self._path('probe')}{_TORN_SUFFIX}"
        try:
            self._filesystem.pipe_file(path, b"probe")
            if self._filesystem.cat_file(path) != b"probe":
                raise OSError(f"{self._root} does not give back what was written.")
        finally:
            self._remove(path)

    def ids(self) -> set[str]:
        """The ids of all archives in the store."""
        return {PurePosixPath(path).stem for path in self._list() if path.endswith(_SUFFIX)}

    def _sync(self, file: IO[bytes]) -> None:
        file.flush()
        if self._local:
            os.fsync(file.fileno())

    def _sync_root(self) -> None:
        if self._local:
            sync_directory(Path(self._root))

    def _list(self) -> list[str]:
        self._filesystem.invalidate_cache()
        try:
            return cast("list[str]", self._filesystem.ls(self._root, detail=False))
        except FileNotFoundError as error:
            # Object stores have no empty folders: where the bucket is, nothing is in it yet.
            if self._local or not self._filesystem.exists(self._root.lstrip("/").partition("/")[0]):
                raise FileNotFoundError(f"There is no store at {self._root}.") from error
            return []

    def _remove(self, path: str) -> None:
        if self._filesystem.exists(path):
            self._filesystem.rm_file(path)

    def _path(self, identifier: str) -> str:
        # Ids are generated; this holds the line should one ever come from outside.
        if not identifier.isalnum():
            raise NotFoundError.of("checkpoint", identifier)
        return f"{self._root}/{identifier}{_SUFFIX}"


def _blocks(file: Any) -> Iterator[bytes]:
    with file:
        while block := file.read(_BLOCK):
            yield block
