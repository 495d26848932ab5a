"""The store is swept of what no checkpoint names, and of nothing that another installation keeps there."""

import asyncio
import hashlib
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
from sqlalchemy import select

from server.app import create_services
from server.checkpoints.archives import GRACE_SECONDS, keep_swept, sweep_archives
from server.database import tables
from server.experiments.service import ExperimentService
from server.services import Services
from server.settings import Settings
from server.worker_api.errors import TooEarlyError
from server.worker_api.service import WorkerService
from workers.config import TrainingConfig
from workers.protocol import CheckpointUpload, ClaimRequest

ARCHIVE = b"an archive"
SOON = GRACE_SECONDS - 1
LATER = GRACE_SECONDS + 1


@pytest.fixture
def services(settings: Settings, database_url: str) -> Iterator[Services]:
    services = create_services(settings.model_copy(update={"database_url": database_url}))
    prepare(services)
    yield services
    services.database.dispose()


@pytest.fixture
def neighbour(settings: Settings, tmp_path: Path) -> Iterator[Services]:
    """Another installation, which keeps its archives in the same store."""
    url = f"sqlite:///{tmp_path / 'neighbour.db'}"
    services = create_services(settings.model_copy(update={"database_url": url}))
    prepare(services)
    yield services
    services.database.dispose()


def prepare(services: Services) -> None:
    """A run that a worker has."""
    with services.database.write() as session:
        session.add(tables.Experiment(id="e", name="x", training=TrainingConfig().model_dump(mode="json")))
        session.flush()
        session.add(tables.Run(id="r", experiment_id="e", seed=0))
    WorkerService(services).claim("r", ClaimRequest(worker="w", published_attempt=0))


async def blocks() -> AsyncIterator[bytes]:
    yield ARCHIVE


def bring(services: Services, archive_id: str, step: int, *, until: str = "registered") -> None:
    """An upload, or its beginning: the server may end at any point of it."""
    service = WorkerService(services)
    sha256 = hashlib.sha256(ARCHIVE).hexdigest()
    service.announce("r", 1, 0, archive_id)
    if until == "announced":
        return
    if until == "torn":
        torn = Path(services.settings.resolved_files_url) / f"{archive_id}.zip.part"
        torn.write_bytes(ARCHIVE[:3])
        return
    file = asyncio.run(services.files.write(archive_id, blocks(), sha256))
    if until == "registered":
        assert service.register("r", 1, step, file, CheckpointUpload(after_seq=0, sha256=sha256))


def stored(services: Services) -> list[str]:
    return sorted(path.name for path in Path(services.settings.resolved_files_url).iterdir())


def loose(services: Services) -> list[str]:
    with services.database.read() as session:
        return list(session.scalars(select(tables.LooseArchive.id).order_by(tables.LooseArchive.id)))


def test_what_was_never_registered_goes_after_the_grace_time_and_what_was_stays(services: Services) -> None:
    bring(services, "kept", 100)
    bring(services, "announced", 200, until="announced")
    bring(services, "torn", 200, until="torn")
    bring(services, "written", 200, until="written")
    everything = ["kept.zip", "torn.zip.part", "written.zip"]
    assert (stored(services), loose(services)) == (everything, ["announced", "torn", "written"])

    assert sweep_archives(services, time.time() + SOON) == 0
    assert stored(services) == everything
    assert sweep_archives(services, time.time() + LATER) == 3
    assert (stored(services), loose(services)) == (["kept.zip"], [])


def test_what_another_installation_keeps_in_the_same_store_is_never_touched(services: Services, neighbour: Services) -> None:
    bring(neighbour, "registered", 100)
    bring(neighbour, "underway", 200, until="torn")
    bring(neighbour, "written", 200, until="written")
    bring(services, "mine", 100, until="written")

    sweep_archives(services, time.time() + LATER)
    ExperimentService(services).delete("e")
    ExperimentService(services).remove("e")
    assert stored(neighbour) == ["registered.zip", "underway.zip.part", "written.zip"]


def test_an_archive_that_is_doomed_is_not_registered_whatever_the_clock_said(services: Services) -> None:
    """The clock is set forward two hours in the middle of an upload."""
    bring(services, "slow", 100, until="written")
    sweep_archives(services, time.time() + LATER)
    sha256 = hashlib.sha256(ARCHIVE).hexdigest()
    file = asyncio.run(services.files.write("slow", blocks(), sha256))
    with pytest.raises(TooEarlyError, match="send it again"):
        WorkerService(services).register("r", 1, 100, file, CheckpointUpload(after_seq=0, sha256=sha256))

    bring(services, "again", 100)
    sweep_archives(services, time.time() + LATER)
    assert "again.zip" in stored(services)


def test_what_a_deletion_left_behind_goes_at_the_next_sweep(services: Services, monkeypatch: pytest.MonkeyPatch) -> None:
    for step in (100, 200, 300):
        bring(services, f"of{step}", step)
    delete = services.files.delete
    removed: list[str] = []

    def break_off(archive_id: str) -> None:
        if removed:
            raise OSError("the store is away")
        removed.append(archive_id)
        delete(archive_id)

    ExperimentService(services).delete("e")
    monkeypatch.setattr(services.files, "delete", break_off)
    with pytest.raises(OSError, match="away"):
        ExperimentService(services).remove("e")
    monkeypatch.undo()
    assert len(stored(services)) == 2

    sweep_archives(services, time.time())
    assert (stored(services), loose(services)) == ([], [])


def test_a_server_that_starts_sweeps(services: Services) -> None:
    bring(services, "torn", 100, until="torn")
    with services.database.write() as session:
        session.get_one(tables.LooseArchive, "torn").since -= LATER

    async def started() -> None:
        async with keep_swept(services):
            deadline = time.monotonic() + 20
            while stored(services):
                assert time.monotonic() < deadline
                await asyncio.sleep(0.02)

    asyncio.run(started())
