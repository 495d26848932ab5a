"""Checkpoints in a real object store, Ceph's: kept whole or not at all, and a training that lives on what lies there."""

import asyncio
import hashlib
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from server.errors import CorruptUploadError, NotFoundError
from server.files import FileStore, StoredFile
from server.ids import new_id
from tests.services.ceph import ObjectStore
from tests.services.stack import ROLLOUT, Service, assert_one_unbroken_curve, until

MEGABYTE = 10**6

pytestmark = pytest.mark.services


@pytest.fixture
def url(ceph: ObjectStore, monkeypatch: pytest.MonkeyPatch) -> str:
    """Of a bucket of one's own; who may write stands in the environment, as for any S3 client."""
    for name, value in ceph.environment.items():
        monkeypatch.setenv(name, value)
    return f"s3://test-{new_id()}/checkpoints"


@pytest.fixture
def store(url: str) -> FileStore:
    return FileStore(url, max_bytes=100 * MEGABYTE)


async def megabytes(count: int) -> AsyncIterator[bytes]:
    for number in range(count):
        yield bytes([number]) * MEGABYTE


def test_what_was_written_is_read_from_any_byte_on_listed_and_removed(store: FileStore) -> None:
    whole = b"".join(bytes([number]) * MEGABYTE for number in range(60))
    digest = hashlib.sha256(whole).hexdigest()
    # Sent in several parts: more than S3 takes at once from this client.
    assert asyncio.run(store.write("abc", megabytes(60), digest)) == StoredFile("abc", 60 * MEGABYTE, digest)
    asyncio.run(store.write("small", megabytes(1)))

    assert store.ids() == {"abc", "small"}
    assert b"".join(store.read("abc")) == whole
    assert b"".join(store.read("abc", 59 * MEGABYTE + 7)) == whole[59 * MEGABYTE + 7 :]
    with store.open("abc") as file:
        file.seek(30 * MEGABYTE)
        assert file.read(3) == bytes([30]) * 3

    store.delete("abc")
    assert store.ids() == {"small"}
    with pytest.raises(NotFoundError):
        store.open("abc")
    store.delete("abc")  # nothing to do, and no error


def test_a_store_with_nothing_in_it_is_a_store(store: FileStore) -> None:
    store.ping()
    store.probe()
    assert store.ids() == set()
    asyncio.run(store.write("abc", megabytes(1)))
    store.delete("abc")
    store.ping()
    assert store.ids() == set()


def test_what_arrives_garbled_or_breaks_off_leaves_nothing(store: FileStore) -> None:
    async def broken() -> AsyncIterator[bytes]:
        yield bytes(MEGABYTE)
        raise ConnectionResetError

    with pytest.raises(CorruptUploadError):
        asyncio.run(store.write("abc", megabytes(1), "0" * 64))
    with pytest.raises(ConnectionResetError):
        asyncio.run(store.write("abc", broken()))
    assert store.ids() == set()
    assert store._list() == []


def test_a_training_lives_on_it(url: str, ceph: ObjectStore, tmp_path: Path) -> None:
    service = Service(tmp_path, MAPLESS_FILES_URL=url, **ceph.environment)
    try:
        service.start_server()
        service.start_worker()
        (run_id,) = service.launch(steps=8 * ROLLOUT)
        until(lambda: service.run(run_id)["step"] >= 3 * ROLLOUT)
        # Stopped and resumed, it goes on from what lies in the store.
        service.api.post(f"/api/runs/{run_id}/stop").raise_for_status()
        service.until_state(run_id, "stopped", "completed")
        service.api.post(f"/api/runs/{run_id}/resume")
        done = service.until_state(run_id, "completed")
        assert done["step"] == 8 * ROLLOUT
        assert_one_unbroken_curve(service, run_id)

        items = service.api.get(f"/api/runs/{run_id}/checkpoints").json()["items"]
        store = FileStore(url, max_bytes=100 * MEGABYTE)
        assert store.ids() == {item["id"] for item in items}
        for item in items:
            archive = service.api.get(f"/api/checkpoints/{item['id']}/download")
            assert hashlib.sha256(archive.content).hexdigest() == archive.headers["etag"].strip('"')
            assert b"".join(store.read(item["id"])) == archive.content
        assert service.api.get("/readyz").status_code == 200

        for action in ("delete", "remove"):
            body = {"action": action, "experiments": [done["experiment_id"]]}
            service.api.post("/api/workbench/actions", json=body).raise_for_status()
        until(lambda: store.ids() == set())
        assert service.api.get("/readyz").status_code == 200
    finally:
        service.close()
