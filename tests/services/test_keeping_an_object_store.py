"""Backups, restores and moves where checkpoints lie in a real object store, Ceph's."""

import asyncio
import hashlib
import os
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest
from sqlalchemy import select

from server.database import tables
from server.database.engine import Database
from server.errors import ConflictError
from server.files import FileStore
from server.ids import new_id
from server.keeping.backup import back_up
from server.keeping.move_checkpoints import move_checkpoints
from server.keeping.restore import restore
from server.settings import Settings
from tests.server.installations import Writer, blocks, everything, installation, quiet, store
from tests.services.ceph import ObjectStore
from tests.services.stack import ROLLOUT, Service, assert_one_unbroken_curve, until

pytestmark = pytest.mark.services


@pytest.fixture
def bucket(ceph: ObjectStore, monkeypatch: pytest.MonkeyPatch) -> Callable[[], str]:
    """Names a place in a new bucket; who may write there stands in the environment, as for any S3 client."""
    for name, value in ceph.environment.items():
        monkeypatch.setenv(name, value)
    return lambda: f"s3://test-{new_id()}/checkpoints"


def elsewhere(place: Path, files_url: str | None = None) -> Settings:
    """Where nothing is."""
    return Settings.model_validate({"data_dir": place, "files_url": files_url})


def names(settings: Settings) -> set[str]:
    """Everything that lies in the store, under whatever name."""
    return {path.rpartition("/")[2] for path in store(settings)._list()}


def test_from_a_directory_to_a_bucket_to_another_and_back(bucket: Callable[[], str], tmp_path: Path) -> None:
    source = installation(tmp_path / "source")
    before = everything(source)
    places = [
        elsewhere(tmp_path / "first", bucket()),
        elsewhere(tmp_path / "second", bucket()),
        elsewhere(tmp_path / "last"),
    ]
    for number, place in enumerate(places):
        said: list[str] = []
        back_up(source, tmp_path / f"{number}.backup", quiet)
        restore(place, tmp_path / f"{number}.backup", said.append)
        assert everything(place) == before
        assert names(place) == {"1checkpoints.zip", "2checkpoints.zip"}
        assert "2 checkpoints" in said[0]
        assert len(said) == 1
        source = place


def test_while_others_write_it_is_one_state_with_every_archive_of_it(bucket: Callable[[], str], tmp_path: Path) -> None:
    source = installation(tmp_path / "source", files_url=bucket())
    large(source, 6)
    with Writer(source) as writer:
        writer.wait_for(6)
        before = writer.written
        manifest = back_up(source, tmp_path / "of-a-bucket.backup", quiet)
        assert writer.written > before, "nobody wrote while the backup was made"
    assert manifest.damaged == ()

    target = elsewhere(tmp_path / "target", bucket())
    restore(target, tmp_path / "of-a-bucket.backup", quiet)
    database = Database(target.resolved_database_url)
    with database.read() as session:
        checkpoints = list(session.scalars(select(tables.Checkpoint)))
    database.dispose()
    assert len(checkpoints) >= 5
    for checkpoint in checkpoints:
        assert hashlib.sha256(b"".join(store(target).read(checkpoint.id))).hexdigest() == checkpoint.sha256


def test_what_lies_in_the_bucket_already_is_said_and_kept(bucket: Callable[[], str], tmp_path: Path) -> None:
    source, target = installation(tmp_path / "source"), elsewhere(tmp_path / "target", bucket())
    back_up(source, tmp_path / "mapless.backup", quiet)
    for name, content in (("1checkpoints", "1checkpoints"), ("another", "another")):
        asyncio.run(store(target).write(name, blocks(content)))
    asyncio.run(store(target).write("2checkpoints", blocks("something else")))
    there = everything(target)["files"]
    with pytest.raises(ConflictError, match="another archive 2checkpoints"):
        restore(target, tmp_path / "mapless.backup", quiet)
    assert everything(target)["files"] == there

    said: list[str] = []
    restore(target, tmp_path / "mapless.backup", said.append, replace=True)
    assert "1 checkpoints" in said[0]
    assert said[1].startswith("1 more checkpoints lay in the store already")
    assert said[2].startswith("1 other archives lie in the store")
    assert everything(target)["files"] == everything(source)["files"] | {"another": there["another"]}


def test_an_archive_that_was_altered_in_the_bucket_is_left_out_and_marked(bucket: Callable[[], str], tmp_path: Path) -> None:
    source = installation(tmp_path / "source", files_url=bucket())
    asyncio.run(store(source).write("1checkpoints", blocks("something else")))
    store(source).delete("2checkpoints")
    said: list[str] = []
    manifest = back_up(source, tmp_path / "damaged.backup", said.append)
    assert manifest.damaged == ("1checkpoints", "2checkpoints")
    assert "1checkpoints, 2checkpoints" in said[1]


def large(source: Settings, count: int) -> None:
    """Checkpoints of some megabytes, so that bringing them takes a while."""

    async def megabytes(number: int) -> AsyncIterator[bytes]:
        for _ in range(8):
            yield bytes([number]) * 2**20

    database = Database(source.resolved_database_url)
    for number in range(count):
        name = f"large{number}"
        file = asyncio.run(store(source).write(name, megabytes(number)))
        with database.write() as session:
            values = {"id": name, "run_id": "1runs", "step": 10 + number, "size": file.size, "sha256": file.sha256}
            session.add(tables.Checkpoint(**values))
    database.dispose()


def mapless(settings: Settings, *arguments: str) -> "subprocess.Popen[str]":
    """A command for an installation, as a process of its own."""
    environment = {**os.environ, "MAPLESS_DATA_DIR": str(settings.data_dir), "MAPLESS_FILES_URL": settings.files_url or ""}
    command = [sys.executable, "-m", "server", *arguments]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def test_a_restore_that_was_killed_is_made_again(bucket: Callable[[], str], tmp_path: Path) -> None:
    source, target = installation(tmp_path / "source"), elsewhere(tmp_path / "target", bucket())
    large(source, 12)
    path = tmp_path / "mapless.backup"
    back_up(source, path, quiet)
    with mapless(target, "restore", str(path)) as killed:
        until(lambda: len(names(target) & {f"large{number}.zip" for number in range(12)}) >= 3)
        killed.send_signal(signal.SIGKILL)
    assert killed.returncode == -signal.SIGKILL
    assert 3 <= len(store(target).ids()) < 14

    with mapless(target, "restore", str(path)) as again:
        said = again.communicate()[0]
    assert again.returncode == 0, said
    assert "more checkpoints lay in the store already" in said
    assert everything(target) == everything(source)
    assert names(target) == {f"{name}.zip" for name in store(source).ids()}


def test_a_store_that_is_away_is_said_in_a_line_and_nothing_is_changed(
    ceph: ObjectStore, bucket: Callable[[], str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, target = installation(tmp_path / "source", files_url=bucket()), elsewhere(tmp_path / "target", bucket())
    path = tmp_path / "mapless.backup"
    back_up(source, path, quiet)
    away, refused = ("AWS_ENDPOINT_URL", "http://127.0.0.1:1"), ("AWS_SECRET_ACCESS_KEY", "wrong")
    for (variable, wrong), settings, command in (
        (away, source, ("backup", str(tmp_path / "second.backup"))),
        (away, target, ("restore", str(path))),
        (refused, source, ("move-checkpoints", str(source.files_url), str(tmp_path / "copies"))),
    ):
        monkeypatch.setenv(variable, wrong)
        with mapless(settings, *command) as process:
            said = process.communicate()[0]
        monkeypatch.setenv(variable, ceph.environment[variable])
        assert (process.returncode, said.count("\n")) == (1, 1), said
        assert said.startswith(f"mapless: The store {settings.files_url} can't be used: ")
    assert [path.name for path in tmp_path.glob("*.backup*")] == ["mapless.backup"]
    restore(target, path, quiet)
    assert everything(target) == everything(source)


def test_checkpoints_move_to_a_bucket_and_back_while_the_service_writes(bucket: Callable[[], str], tmp_path: Path) -> None:
    source, url, said = installation(tmp_path / "source"), bucket(), list[str]()
    here = source.resolved_files_url
    with Writer(source) as writer:
        writer.wait_for(4)
        move_checkpoints(source, here, url, said.append)
        writer.wait_for(writer.written + 3)
    first = int(said[0].split()[0])
    assert first >= 5
    assert said[0].endswith("0 were there already.")

    # Once more with the service stopped, for what has come since then.
    said.clear()
    move_checkpoints(source, here, url, said.append)
    moved = source.model_copy(update={"files_url": url})
    database = Database(source.resolved_database_url)
    with database.read() as session:
        named = set(session.scalars(select(tables.Checkpoint.id)))
        loose = session.scalars(select(tables.LooseArchive.id).where(tables.LooseArchive.doomed.is_(False)))
        named |= {name for name in loose if name in store(source).ids()}
    database.dispose()
    assert named <= store(moved).ids()
    assert not said[0].endswith(" 0 were there already.")
    # What was removed here meanwhile is there still.
    gone = len(store(moved).ids() - named)
    assert (f"{gone} other archives" in said[1]) == (gone > 0)

    move_checkpoints(moved, url, str(tmp_path / "back"), quiet)
    back = FileStore(str(tmp_path / "back"), 10**9)
    assert back.ids() == named
    for name in named:
        assert b"".join(back.read(name)) == b"".join(store(moved).read(name))


def test_what_is_damaged_or_gone_is_not_moved_and_what_is_damaged_there_is_moved_anew(
    bucket: Callable[[], str], tmp_path: Path
) -> None:
    source, url, said = installation(tmp_path / "source"), bucket(), list[str]()
    move_checkpoints(source, source.resolved_files_url, url, quiet)
    target = FileStore(url, 10**9)
    asyncio.run(target.write("1checkpoints", blocks("something else")))
    asyncio.run(store(source).write("2checkpoints", blocks("something else")))
    target.delete("2checkpoints")
    move_checkpoints(source, source.resolved_files_url, url, said.append)
    assert said[0].startswith("1 checkpoints were copied")
    assert "left out: the archives of checkpoints 2checkpoints." in said[1]
    assert target.ids() == {"1checkpoints"}
    assert b"".join(target.read("1checkpoints")) == b"".join(store(source).read("1checkpoints"))
    with pytest.raises(ConflictError, match="no folder"):
        move_checkpoints(source, str(tmp_path / "nowhere"), url, quiet)
    assert not (tmp_path / "nowhere").exists()


def test_a_lab_moves_with_all_it_has_and_trains_on(
    ceph: ObjectStore, bucket: Callable[[], str], empty_postgres_url: str, tmp_path: Path
) -> None:
    """A training is backed up while it runs, restored elsewhere, moved to PostgreSQL, and trained to its end."""
    (tmp_path / "first").mkdir()
    (tmp_path / "second").mkdir()
    first = Service(tmp_path / "first", MAPLESS_FILES_URL=bucket(), **ceph.environment)
    second = Service(tmp_path / "second", MAPLESS_FILES_URL=bucket(), **ceph.environment)

    def command(service: Service, *arguments: str) -> str:
        call = [sys.executable, "-m", "server", *arguments]
        done = subprocess.run(call, env=service.environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    try:
        first.start_server()
        first.start_worker()
        (run_id,) = first.launch(steps=12 * ROLLOUT)
        until(lambda: len(first.checkpoints(run_id)) >= 2)
        command(first, "backup", str(tmp_path / "mapless.backup"))
        kept = first.run(run_id)["step"]
        first.close()

        said = command(second, "restore", str(tmp_path / "mapless.backup"))
        assert "checkpoints, as they were on" in said
        database = f"sqlite:///{tmp_path / 'second' / 'data' / 'mapless.db'}"
        command(second, "move", database, empty_postgres_url)
        second.environment["MAPLESS_DATABASE_URL"] = empty_postgres_url
        second.start_server()
        before = second.checkpoints(run_id)
        assert len(before) >= 2
        assert before[-1] <= kept
        second.start_worker()
        assert second.until_state(run_id, "completed")["step"] == 12 * ROLLOUT
        assert_one_unbroken_curve(second, run_id)
        for item in second.api.get(f"/api/runs/{run_id}/checkpoints").json()["items"]:
            archive = second.api.get(f"/api/checkpoints/{item['id']}/download")
            assert hashlib.sha256(archive.content).hexdigest() == archive.headers["etag"].strip('"')
    finally:
        first.close()
        second.close()
