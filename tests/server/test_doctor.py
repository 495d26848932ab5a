"""`mapless doctor`: everything is well, or it says what is not and what to do; it changes nothing."""

import json
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from server.app import create_services
from server.database.engine import Database
from server.doctor.checks import examine
from server.doctor.findings import Finding, look
from server.settings import Settings
from server.system.repository import WorkerRepository
from tests.conftest import require_service
from tests.server.test_serving import ROOT, environment, serving

NAMES = ["versions", "data", "disk", "database", "clock", "broker", "store", "extensions", "server"]


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
        return port


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Of an installation that was started before, whose server does not run now."""
    settings = Settings.model_validate({"data_dir": settings.data_dir, "port": free_port()})
    create_services(settings).database.dispose()
    return settings


def ailing(settings: Settings) -> dict[str, Finding]:
    """What is wrong, by part; whatever is wrong comes with advice."""
    found = examine(settings)
    assert [finding.name for finding in found] == NAMES
    assert all((finding.advice is None) == finding.ok for finding in found)
    return {finding.name: finding for finding in found if not finding.ok}


def test_all_is_well(settings: Settings) -> None:
    assert ailing(settings) == {}


def test_before_the_first_start_all_is_well_and_nothing_is_made(tmp_path: Path) -> None:
    settings = Settings.model_validate({"data_dir": tmp_path / "new" / "data", "port": free_port()})

    assert ailing(settings) == {}
    assert list(tmp_path.iterdir()) == []


def test_a_database_that_is_away(settings: Settings) -> None:
    url = f"postgresql+psycopg://mapless:secret@127.0.0.1:{free_port()}/mapless"
    found = ailing(settings.model_copy(update={"database_url": url}))

    assert set(found) == {"database", "clock"}
    assert "MAPLESS_DATABASE_URL" in (found["database"].advice or "")
    assert "secret" not in str(found)


def test_a_database_of_a_newer_version(settings: Settings) -> None:
    with opened(settings) as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))

    found = ailing(settings)
    assert set(found) == {"database"}
    assert "newer version" in found["database"].found
    assert "Update the program" in (found["database"].advice or "")


@contextmanager
def opened(settings: Settings) -> Iterator[Session]:
    database = Database(settings.resolved_database_url)
    with database.write() as session:
        yield session
    database.dispose()


def test_a_database_that_is_no_database(settings: Settings) -> None:
    (settings.data_dir / "mapless.db").write_bytes(b"this is no database " * 1_000)
    for name in ("mapless.db-wal", "mapless.db-shm"):
        (settings.data_dir / name).unlink(missing_ok=True)

    assert "database" in ailing(settings)


def test_a_clock_that_was_set_back(settings: Settings) -> None:
    with opened(settings) as session:
        WorkerRepository(session).seen("w", "cpu", time.time() + 3_600)

    found = ailing(settings)
    assert set(found) == {"clock"}
    assert "from the future" in found["clock"].found


def test_a_clock_that_differs_from_the_databases(
    postgres_url: str, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    ours = settings.model_copy(update={"database_url": postgres_url})
    assert ailing(ours) == {}

    now = time.time
    monkeypatch.setattr("server.doctor.checks.time.time", lambda: now() - 30)
    found = ailing(ours)
    assert set(found) == {"clock"}
    assert "The database's clock is +30" in found["clock"].found


@pytest.mark.parametrize("scheme", ["redis", "amqp"])
def test_a_broker_that_is_away(settings: Settings, scheme: str) -> None:
    url = f"{scheme}://:secret@127.0.0.1:{free_port()}//"
    found = ailing(settings.model_copy(update={"broker_url": url}))

    assert set(found) == {"broker"}
    assert "MAPLESS_BROKER_URL" in (found["broker"].advice or "")
    assert "secret" not in str(found)


@pytest.mark.parametrize(
    ("url", "port"), [("redis://127.0.0.1:6379/9", 6379), ("amqp://guest:guest@127.0.0.1:5672//", 5672)]
)
def test_a_broker_that_answers(settings: Settings, url: str, port: int) -> None:
    require_service(url.partition(":")[0], "127.0.0.1", port)

    assert ailing(settings.model_copy(update={"broker_url": url})) == {}


def test_an_embedded_broker_that_is_damaged(settings: Settings) -> None:
    (settings.data_dir / "broker.db").write_bytes(b"this is no database " * 1_000)

    assert set(ailing(settings)) == {"broker"}


def test_a_store_that_keeps_nothing(settings: Settings) -> None:
    shutil.rmtree(settings.resolved_files_url)
    Path(settings.resolved_files_url).write_text("a file in its place")

    found = ailing(settings)
    assert set(found) == {"store"}
    assert "MAPLESS_FILES_URL" in (found["store"].advice or "")


def test_a_store_of_a_kind_that_is_unknown(settings: Settings) -> None:
    assert set(ailing(settings.model_copy(update={"files_url": "nonsense://bucket"}))) == {"store"}


def test_a_disk_that_is_full(settings: Settings) -> None:
    found = ailing(settings.model_copy(update={"min_free_disk_bytes": 2**60}))

    assert set(found) == {"disk"}
    assert "are free at" in found["disk"].found


def test_a_token_that_others_may_read(settings: Settings) -> None:
    (settings.data_dir / "token").chmod(0o644)

    found = ailing(settings)
    assert set(found) == {"data"}
    assert "chmod 600" in (found["data"].advice or "")


def test_a_data_directory_that_cannot_be_made(tmp_path: Path) -> None:
    # Below a file there is no folder, for anybody.
    (tmp_path / "file").touch()
    found = ailing(Settings.model_validate({"data_dir": tmp_path / "file" / "data", "port": free_port()}))

    assert {"data", "store"} <= set(found)
    assert "MAPLESS_DATA_DIR" in (found["data"].advice or "")


def test_a_server_that_runs_and_one_of_another_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(tmp_path / "data") as (_, url):
        settings = Settings.model_validate({"data_dir": tmp_path / "data", "port": httpx.URL(url).port})
        deadline = time.monotonic() + 30
        while httpx.get(f"{url.partition('/?')[0]}/readyz").status_code != 200:
            assert time.monotonic() < deadline
            time.sleep(0.2)
        assert ailing(settings) == {}
        monkeypatch.setattr("server.doctor.checks.version", lambda: "99.0")
        found = ailing(settings)
        assert set(found) == {"versions"}
        assert "Restart the server" in (found["versions"].advice or "")
        monkeypatch.undo()
        shutil.rmtree(settings.resolved_files_url)
        time.sleep(1.5)
        assert "store" in ailing(settings)["server"].found


def test_a_part_that_never_answers_does_not_hang_the_command() -> None:
    began = time.monotonic()

    finding = look("database", sleep_for_ever, "Start it.", seconds=0.2)
    assert finding == Finding("database", False, "no answer within 0.2 s", "Start it.")
    assert time.monotonic() - began < 5


def sleep_for_ever() -> str:
    time.sleep(60)
    return "never"


def test_the_command_says_it_in_lines_and_in_json(tmp_path: Path) -> None:
    def run(*arguments: str, **more: str) -> tuple[int, str]:
        command = [sys.executable, "-m", "server", "doctor", *arguments]
        env = environment(tmp_path / "data") | {"MAPLESS_PORT": str(free_port())} | more
        result = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True)
        assert result.stderr == ""
        return result.returncode, result.stdout

    code, said = run()
    assert code == 0
    assert [line.split()[:2] for line in said.splitlines()] == [["ok", name] for name in NAMES]
    code, said = run("--json", MAPLESS_BROKER_URL=f"redis://127.0.0.1:{free_port()}/0")
    assert code == 1
    told = json.loads(said)
    assert told["ok"] is False
    assert [finding["name"] for finding in told["findings"] if not finding["ok"]] == ["broker"]
    code, said = run(MAPLESS_BROKER_URL=f"redis://127.0.0.1:{free_port()}/0")
    assert code == 1
    assert "FAIL  broker" in said
