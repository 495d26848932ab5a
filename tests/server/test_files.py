"""The file store: whole archives or none, on a directory and on any other fsspec store."""

import asyncio
import hashlib
import os
import threading
import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from starlette.concurrency import run_in_threadpool

from server.errors import CorruptUploadError, NotFoundError, TooLargeError
from server.files import FileStore, StoreAwayError, StoredFile, UnusableStoreError
from server.ids import new_id


@pytest.fixture(params=["directory", "memory"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> FileStore:
    url = str(tmp_path / "checkpoints") if request.param == "directory" else f"memory://{new_id()}"
    return FileStore(url, max_bytes=1_000)


async def blocks(*parts: bytes) -> AsyncIterator[bytes]:
    for part in parts:
        yield part


def write(store: FileStore, identifier: str, *parts: bytes, sha256: str | None = None) -> StoredFile:
    return asyncio.run(store.write(identifier, blocks(*parts), sha256))


def test_what_was_written_is_read(store: FileStore) -> None:
    digest = hashlib.sha256(b"weights").hexdigest()

    assert write(store, "abc", b"wei", b"ghts", sha256=digest.upper()) == StoredFile("abc", 7, digest)
    assert b"".join(store.read("abc")) == b"weights"
    assert store.ids() == {"abc"}


def test_an_upload_that_grows_too_large_leaves_nothing(store: FileStore) -> None:
    with pytest.raises(TooLargeError):
        write(store, "abc", b"x" * 600, b"x" * 600)

    assert store.ids() == set()


def test_an_upload_that_was_garbled_leaves_nothing(store: FileStore) -> None:
    with pytest.raises(CorruptUploadError):
        write(store, "abc", b"weights", sha256="0" * 64)

    assert store.ids() == set()


def test_an_upload_that_breaks_off_leaves_nothing(store: FileStore) -> None:
    async def broken() -> AsyncIterator[bytes]:
        yield b"wei"
        raise ConnectionResetError

    with pytest.raises(ConnectionResetError):
        asyncio.run(store.write("abc", broken()))

    assert store.ids() == set()


def test_an_archive_that_is_gone(store: FileStore) -> None:
    with pytest.raises(NotFoundError):
        store.read("abc")
    store.delete("abc")  # nothing to do, and no error


def test_what_a_crash_left_of_an_upload_goes_with_its_archive_and_nothing_else_does(tmp_path: Path) -> None:
    store = FileStore(str(tmp_path), max_bytes=1_000)
    write(store, "kept", b"x")
    (tmp_path / "torn.zip.part").write_bytes(b"wei")
    (tmp_path / "elsewhere.zip.part").write_bytes(b"wei")
    (tmp_path / "somebody-elses.zip").write_bytes(b"x")

    assert store.ids() == {"kept", "somebody-elses"}
    store.delete("torn")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["elsewhere.zip.part", "kept.zip", "somebody-elses.zip"]


@pytest.mark.parametrize("url", ["nothing://bucket/checkpoints", "abfs://bucket/checkpoints"])
def test_a_store_that_is_not_known_here_is_named(url: str) -> None:
    with pytest.raises(UnusableStoreError, match="MAPLESS_FILES_URL"):
        FileStore(url, max_bytes=1_000)


@pytest.mark.parametrize("identifier", ["../secret", "a/b", "", ".", "a.zip", "/etc/passwd"])
def test_an_id_is_never_a_path(store: FileStore, identifier: str) -> None:
    with pytest.raises(NotFoundError):
        store.read(identifier)
    with pytest.raises(NotFoundError):
        write(store, identifier, b"x")


def test_an_archive_and_its_name_are_on_disk_before_anybody_is_told_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A row must never outlive its file in a power cut: the file is synced under its first name, then the folder."""
    store = FileStore(str(tmp_path), max_bytes=1_000)
    synced: list[tuple[int, list[str]]] = []
    sync = os.fsync

    def note(descriptor: int) -> None:
        sync(descriptor)
        synced.append((os.fstat(descriptor).st_ino, sorted(path.name for path in tmp_path.iterdir())))

    monkeypatch.setattr(os, "fsync", note)
    write(store, "abc", b"weights")
    assert synced == [
        ((tmp_path / "abc.zip").stat().st_ino, ["abc.zip.part"]),
        (tmp_path.stat().st_ino, ["abc.zip"]),
    ]


def test_a_store_that_takes_its_time_keeps_nobody_from_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = FileStore(str(tmp_path), 1_000)
    done = threading.Event()
    monkeypatch.setattr(store, "_sync", lambda file: done.wait(60))

    async def uploads() -> None:
        # As many as there are threads for readers, and more.
        writing = [asyncio.create_task(store.write(f"{n:032x}", blocks(b"x"))) for n in range(60)]
        await asyncio.sleep(0.2)
        await asyncio.wait_for(run_in_threadpool(time.monotonic), 10)
        done.set()
        assert len(await asyncio.gather(*writing)) == 60

    asyncio.run(uploads())


def test_what_is_left_of_uploads_by_a_killed_process_is_removed_by_name(store: FileStore) -> None:
    write(store, "abc", b"weights")
    for name in ("abc", "def", "other"):
        store._filesystem.pipe_file(f"{store._root}/{name}.zip.part", b"wei")

    store.clear_torn(["abc", "def", "ghi"])

    assert sorted(path.rpartition("/")[2] for path in store._list()) == ["abc.zip", "other.zip.part"]


def test_what_a_store_of_another_kind_raises_is_told_with_the_stores_name() -> None:
    class Away:
        """As botocore has them: no OSError."""

        def __getattr__(self, _name: str) -> object:
            def fail(*_: object, **__: object) -> None:
                raise RuntimeError("nobody there")

            return fail

    store = FileStore(url := f"memory://{new_id()}", max_bytes=1_000)
    write(store, "abc", b"weights")
    file = store.open("abc")
    store._filesystem = Away()
    file._file = Away()  # type: ignore[attr-defined]
    for ask in (store.ping, store.probe, store.ids, lambda: store.open("abc"), lambda: store.delete("abc"), file.read):
        with pytest.raises(StoreAwayError, match=f"{url} can't be used: nobody there"):
            ask()
    with pytest.raises(StoreAwayError, match="nobody there"):
        write(store, "def", b"weights")
