"""Where checkpoint archives lie: a directory or any fsspec store, under names that the service generates."""

import hashlib
import os
from collections.abc import AsyncIterable, Callable, Collection, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO, Any, Self, TypeVar, TypeVarTuple, cast

import fsspec
from anyio import CapacityLimiter, to_thread
from fsspec.implementations.local import LocalFileSystem

from server.errors import CorruptUploadError, NotFoundError, PartAwayError, ServiceError, TooLargeError
from server.outage import RETRY_AFTER, Outage
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


class StoreAwayError(PartAwayError, OSError):
    """A store that is not a directory can't be reached, or refuses; later it may not."""


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
        outage: is told when the store goes and comes back; None where its errors are all that anybody needs.

    Raises:
        UnusableStoreError: the URL's kind of store is not known here.
        OSError: it can't be reached or made. All methods raise this too, `StoreAwayError` where it is no directory.
    """

    def __init__(self, url: str, max_bytes: int, outage: Outage | None = None) -> None:
        try:
            self._filesystem, self._root = fsspec.core.url_to_fs(url)
        except (ImportError, ValueError) as error:
            raise UnusableStoreError(f"Checkpoints can't be kept at {url} (MAPLESS_FILES_URL): {error}") from error
        self._url = url
        self._max_bytes = max_bytes
        self._limiter = CapacityLimiter(_THREADS)
        self._local = isinstance(self._filesystem, LocalFileSystem)
        self._outage = outage
        with self._answering():
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
        with self._answering():
            return await to_thread.run_sync(work, *arguments, limiter=self._limiter)

    def open(self, identifier: str) -> IO[bytes]:
        """The archive as a file to read and seek in; the caller closes it.

        Raises:
            NotFoundError: the store has no such archive.
        """
        try:
            with self._answering():
                file = self._filesystem.open(self._path(identifier), "rb")
        except FileNotFoundError as error:
            raise NotFoundError(f"The archive of checkpoint {identifier} is gone from the store.") from error
        return cast("IO[bytes]", file if self._local else _RemoteFile(file, self._answering))

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
        with self._answering():
            self._remove(path)
            self._remove(path + _TORN_SUFFIX)

    def clear_torn(self, identifiers: Collection[str]) -> None:
        """Remove what is left of uploads of these ids by a process that was killed; nobody else may write them now."""
        torn = {PurePosixPath(path).name for path in self._list() if path.endswith(_TORN_SUFFIX)}
        for identifier in identifiers:
            path = self._path(identifier) + _TORN_SUFFIX
            if PurePosixPath(path).name in torn:
                with self._answering():
                    self._remove(path)

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
        with self._answering():
            try:
                self._filesystem.pipe_file(path, b"probe")
                if self._filesystem.cat_file(path) != b"probe":
                    raise OSError(f"{self._root} does not give back what was written.")
            finally:
                self._remove(path)

    def ids(self) -> set[str]:
        """The ids of all archives in the store."""
        return {PurePosixPath(path).stem for path in self._list() if path.endswith(_SUFFIX)}

    @contextmanager
    def _answering(self) -> Iterator[None]:
        """Whatever a store's own library raises becomes what every caller knows, and says which store it is about."""
        try:
            yield
        except Exception as error:
            if self._local or isinstance(error, (FileNotFoundError, ServiceError)):
                raise
            if self._outage is not None:
                self._outage.gone(str(error))
            raise StoreAwayError(f"The store {self._url} can't be used: {error}", retry_after=RETRY_AFTER) from error
        if self._outage is not None:
            self._outage.back()

    def _sync(self, file: IO[bytes]) -> None:
        file.flush()
        if self._local:
            os.fsync(file.fileno())

    def _sync_root(self) -> None:
        if self._local:
            sync_directory(Path(self._root))

    def _list(self) -> list[str]:
        with self._answering():
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


class _RemoteFile:
    """A file of a store that may go away while it is read."""

    def __init__(self, file: IO[bytes], answering: Callable[[], AbstractContextManager[None]]) -> None:
        self._file = file
        self._answering = answering

    def read(self, size: int = -1) -> bytes:
        """The next bytes."""
        with self._answering():
            return self._file.read(size)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


def _blocks(file: Any) -> Iterator[bytes]:
    with file:
        while block := file.read(_BLOCK):
            yield block
