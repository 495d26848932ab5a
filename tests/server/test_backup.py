"""`mapless backup` and `restore`: one state of rows and archives while others write, checked before anything is changed."""

import asyncio
import hashlib
import json
import shutil
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from sqlalchemy import func, select, text, update
from typer.testing import CliRunner

from server.app import create_services
from server.checkpoints.archives import GRACE_SECONDS, sweep_archives
from server.checkpoints.hold import held
from server.cli import app
from server.database import tables
from server.database.engine import Database
from server.database.migrate import bring, head, known_revisions, revision
from server.database.rebuilding import rebuilding
from server.errors import ConflictError, CorruptUploadError
from server.experiments.service import ExperimentService
from server.keeping import restore as restoring
from server.keeping.backup import back_up
from server.keeping.restore import restore
from server.services import Services
from server.settings import Settings
from tests.server.filling import fill, rows
from tests.server.installations import Writer, blocks, everything, installation, keep, quiet, store
from tests.server.test_serving import environment, serving

LATER = GRACE_SECONDS + 1


@pytest.fixture
def source(tmp_path: Path, new_database: Path) -> Settings:
    return installation(tmp_path / "source", f"sqlite:///{shutil.copy(new_database, tmp_path / 'source.db')}")


@pytest.fixture
def either(tmp_path: Path, database_url: str) -> Settings:
    """An installation on each kind of database."""
    return installation(tmp_path / "source", database_url)


@pytest.fixture
def target(tmp_path: Path) -> Settings:
    """Where nothing is."""
    return Settings.model_validate({"data_dir": tmp_path / "target"})


@pytest.fixture
def backup(source: Settings, tmp_path: Path) -> Path:
    path = tmp_path / "mapless.backup"
    back_up(source, path, quiet)
    return path


def test_what_was_there_is_there_again(either: Settings, target: Settings, tmp_path: Path) -> None:
    """Whichever of the two databases it was made of: here it goes to SQLite."""
    source, backup, said = either, tmp_path / "either.backup", list[str]()
    back_up(either, backup, quiet)
    restore(target, backup, said.append)

    assert everything(target) == everything(source)
    assert len(everything(target)["files"]) == 5
    assert "2 checkpoints" in said[0]
    assert not list(backup.parent.glob("*.part"))


@pytest.mark.services
def test_postgresql_is_brought_back_to_what_it_was(postgres_url: str, tmp_path: Path) -> None:
    settings = installation(tmp_path / "data", postgres_url)
    before = everything(settings)
    back_up(settings, tmp_path / "of-postgresql.backup", quiet)
    database = Database(postgres_url)
    with database.write() as session:
        session.execute(text("DELETE FROM runs"))
        session.execute(text("DELETE FROM workers"))
    database.dispose()
    with pytest.raises(ConflictError, match="not empty"):
        restore(settings, tmp_path / "of-postgresql.backup", quiet)
    restore(settings, tmp_path / "of-postgresql.backup", quiet, replace=True)
    assert everything(settings) == before


def test_while_others_write_it_is_one_state_with_every_archive_of_it(
    either: Settings, target: Settings, tmp_path: Path
) -> None:
    """Archives are removed all the time: those that the state names have to wait."""
    with Writer(either) as writer:
        writer.wait_for(6)
        before = writer.written
        manifest = back_up(either, tmp_path / "first.backup", quiet)
        after = writer.written
        writer.wait_for(after + 3)
    assert after > before, "nobody wrote while the backup was made"
    assert manifest.damaged == ()

    restore(target, tmp_path / "first.backup", quiet)
    database = Database(target.resolved_database_url)
    with database.read() as session:
        run = session.get_one(tables.Run, "kept")
        count = session.scalar(select(func.count()).select_from(tables.MetricRow).where(tables.MetricRow.run_id == "kept"))
        checkpoints = list(session.scalars(select(tables.Checkpoint)))
    database.dispose()
    assert before - 1 <= run.last_seq <= after
    assert count == run.last_seq
    assert len(checkpoints) >= 5
    for checkpoint in checkpoints:
        assert hashlib.sha256(b"".join(store(target).read(checkpoint.id))).hexdigest() == checkpoint.sha256


def test_archives_that_a_backup_needs_are_removed_after_it(source: Settings) -> None:
    services = create_services(source)
    with services.database.write() as session:
        session.execute(update(tables.Experiment).where(tables.Experiment.id == "1experiments").values(deleted_at=1.0))
    with held(source.data_dir):
        ExperimentService(services).remove("1experiments")
        assert sweep_archives(services, time.time() + LATER) == 0
        assert "1checkpoints" in services.files.ids()
    # Those of the table of loose archives besides.
    assert sweep_archives(services, time.time() + LATER) == 3
    assert services.files.ids() == {"2checkpoints"}
    services.database.dispose()


@pytest.mark.parametrize("made_at", [known_revisions()[0], "0003", "0007", "0009", "0011", known_revisions()[-2]])
def test_one_of_an_older_version_is_brought_to_this(made_at: str, target: Settings, tmp_path: Path) -> None:
    older = Settings.model_validate({"data_dir": tmp_path / "older"})
    database = Database(older.resolved_database_url)
    with rebuilding(database) as connection:
        bring(connection, made_at)
    fill(database)
    before = rows(database)
    database.dispose()
    keep(older, "1checkpoints", "2checkpoints")
    manifest = back_up(older, tmp_path / "older.backup", quiet)
    assert manifest.revision == made_at

    restore(target, tmp_path / "older.backup", quiet)
    database = Database(target.resolved_database_url)
    after = rows(database)
    assert revision(database) == head()
    assert {table: len(found) for table, found in before.items()}.items() <= {t: len(f) for t, f in after.items()}.items()
    assert [row["id"] for row in after["runs"]] == ["1runs", "2runs"]
    database.dispose()
    create_services(target).database.dispose()


def rewritten(backup: Path, path: Path, change: Callable[[dict[str, bytes]], None]) -> Path:
    """A copy of a backup in which something else stands."""
    with zipfile.ZipFile(backup) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    change(parts)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return path


def altered_digit(parts: dict[str, bytes]) -> None:
    parts["tables/runs.jsonl"] = parts["tables/runs.jsonl"].replace(b"0.25", b"0.26", 1)


def altered_archive(parts: dict[str, bytes]) -> None:
    parts["checkpoints/1checkpoints.zip"] = parts["checkpoints/1checkpoints.zip"].replace(b"archive", b"another", 1)


def lost_part(parts: dict[str, bytes]) -> None:
    del parts["checkpoints/2checkpoints.zip"]


def surplus_part(parts: dict[str, bytes]) -> None:
    parts["../../etc/passwd"] = b"x"


def no_manifest(parts: dict[str, bytes]) -> None:
    del parts["manifest.json"]


def other_format(parts: dict[str, bytes]) -> None:
    parts["manifest.json"] = parts["manifest.json"].replace(b'"format": 1', b'"format": 2')


def lost_row(parts: dict[str, bytes]) -> None:
    """By somebody who mended the manifest too, which names the parent's table no more."""
    manifest = json.loads(parts["manifest.json"])
    del manifest["tables"]["experiments"], manifest["parts"]["tables/experiments.jsonl"], parts["tables/experiments.jsonl"]
    parts["manifest.json"] = json.dumps(manifest).encode()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (altered_digit, "damaged"),
        (altered_archive, "damaged"),
        (lost_part, "manifest says"),
        (surplus_part, "manifest says"),
        (no_manifest, "no backup"),
        (other_format, "another version"),
        (lost_row, "table experiments"),
    ],
)
def test_what_is_not_as_it_was_written_is_refused_and_leaves_nothing(
    backup: Path, target: Settings, tmp_path: Path, change: Callable[[dict[str, bytes]], None], reason: str
) -> None:
    with pytest.raises((CorruptUploadError, ConflictError), match=reason):
        restore(target, rewritten(backup, tmp_path / "changed.backup", change), quiet)
    database = Database(target.resolved_database_url)
    assert (rows(database), store(target).ids()) == ({}, set())
    database.dispose()


def test_one_that_was_cut_off_or_is_of_a_newer_version_is_refused(backup: Path, target: Settings, tmp_path: Path) -> None:
    torn = tmp_path / "torn.backup"
    torn.write_bytes(backup.read_bytes()[:-2_000])
    with pytest.raises(CorruptUploadError, match="not whole"):
        restore(target, torn, quiet)

    def newer(parts: dict[str, bytes]) -> None:
        parts["manifest.json"] = parts["manifest.json"].replace(f'"{head()}"'.encode(), b'"9999"')

    with pytest.raises(ConflictError, match="newer version of Mapless"):
        restore(target, rewritten(backup, tmp_path / "newer.backup", newer), quiet)


def test_a_restore_that_breaks_off_changes_nothing_and_is_made_anew(
    backup: Path, source: Settings, target: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    def break_off(*_: object) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr(restoring, "_go_on_from_here", break_off)
    with pytest.raises(OSError, match="full"):
        restore(target, backup, quiet)
    database = Database(target.resolved_database_url)
    assert (rows(database), store(target).ids()) == ({}, set())
    database.dispose()
    monkeypatch.undo()

    restore(target, backup, quiet)
    assert everything(target) == everything(source)


def test_what_is_there_is_given_up_only_when_told_and_its_archives_are_swept(
    backup: Path, target: Settings, source: Settings
) -> None:
    services = create_services(target)
    fill(services.database)
    with services.database.write() as session:
        session.add(tables.Checkpoint(id="old", run_id="1runs", step=7, size=0, sha256=""))
    services.database.dispose()
    keep(target, "old", "2checkpoints")
    before = everything(target)
    with pytest.raises(ConflictError, match=r"not empty .*2 experiments"):
        restore(target, backup, quiet)
    assert everything(target) == before

    restore(target, backup, quiet, replace=True)
    services = create_services(target)
    sweep_archives(services, time.time())
    services.database.dispose()
    assert store(target).ids() == {"1checkpoints", "2checkpoints"}
    after = everything(target)
    assert after["files"] == everything(source)["files"]


def test_archives_that_are_damaged_are_left_out_said_and_marked(source: Settings, target: Settings, tmp_path: Path) -> None:
    asyncio.run(store(source).write("1checkpoints", blocks("something else")))
    store(source).delete("2checkpoints")
    said: list[str] = []
    manifest = back_up(source, tmp_path / "damaged.backup", said.append)
    assert manifest.damaged == ("1checkpoints", "2checkpoints")
    assert "left out" in said[1]
    database = Database(source.resolved_database_url)
    with database.write() as session:
        session.execute(text("UPDATE checkpoints SET damaged_at = NULL"))
    database.dispose()
    (tmp_path / "damaged.backup").unlink()
    back_up(source, tmp_path / "damaged.backup", quiet)

    restore(target, tmp_path / "damaged.backup", quiet)
    services: Services = create_services(target)
    with services.database.read() as session:
        assert all(session.scalars(select(tables.Checkpoint.damaged_at)))
    services.database.dispose()


def test_a_worker_that_went_on_after_the_backup_is_cut_off(source: Settings, target: Settings, tmp_path: Path) -> None:
    database = Database(source.resolved_database_url)
    with database.write() as session:
        session.execute(text("UPDATE runs SET state = 'running', attempt = 4 WHERE id = '1runs'"))
        session.execute(text("UPDATE runs SET state = 'completed', attempt = 4 WHERE id = '2runs'"))
    database.dispose()
    back_up(source, tmp_path / "running.backup", quiet)
    restore(target, tmp_path / "running.backup", quiet)
    database = Database(target.resolved_database_url)
    assert {row["id"]: row["attempt"] for row in rows(database)["runs"]} == {"1runs": 5, "2runs": 4}
    database.dispose()


def test_no_backup_over_a_file_without_room_or_of_nothing(
    backup: Path, source: Settings, target: Settings, tmp_path: Path
) -> None:
    content = backup.read_bytes()
    with pytest.raises(ConflictError, match="there already"):
        back_up(source, backup, quiet)
    assert backup.read_bytes() == content
    with pytest.raises(ConflictError, match="nothing to back up"):
        back_up(target, tmp_path / "empty.backup", quiet)
    database = Database(source.resolved_database_url)
    with database.write() as session:
        session.execute(text(f"UPDATE checkpoints SET size = {2**60} WHERE id = '1checkpoints'"))
    database.dispose()
    with pytest.raises(ConflictError, match="GiB are needed"):
        back_up(source, tmp_path / "large.backup", quiet)
    assert sorted(path.name for path in tmp_path.glob("*.backup*")) == ["mapless.backup"]


def test_by_its_commands_while_the_service_runs_and_not_restored_under_it(tmp_path: Path) -> None:
    def mapless(*arguments: str, data: str) -> tuple[int, str]:
        result = CliRunner().invoke(app, arguments, prog_name="mapless", env=environment(tmp_path / data))
        return result.exit_code, result.output

    path = str(tmp_path / "mapless.backup")
    with serving(tmp_path / "data"):
        status, said = mapless("backup", path, data="data")
        assert status == 0, said
        status, said = mapless("restore", path, "--replace", data="data")
        assert (status, "A server runs" in said) == (1, True)
        status, said = mapless("restore", path, data="elsewhere")
        assert status == 0, said
    assert Path(path).stat().st_mode & 0o077 == 0
    token = (tmp_path / "data" / "token").read_text()
    assert (tmp_path / "elsewhere" / "token").read_text() == token
    assert (tmp_path / "elsewhere" / "token").stat().st_mode & 0o077 == 0
    status, said = mapless("restore", str(tmp_path / "data" / "token"), data="third")
    assert (status, "not whole" in said) == (1, True)
