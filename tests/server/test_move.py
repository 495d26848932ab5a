"""`mapless move`: every row of every table, to the bit, in both directions; nothing is overwritten, nothing half done."""

import shutil
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sqlalchemy import text

from server.database import tables
from server.database.engine import Database
from server.database.migrate import bring, head, revision, upgrade
from server.database.rebuilding import rebuilding
from server.database.tables import Base
from server.errors import ConflictError, ServiceError
from server.keeping.move import move
from server.keeping.rows import UnfitRowsError
from tests.server.filling import fill, rows


@pytest.fixture
def open_database() -> Iterator[Callable[[str], Database]]:
    """Opens databases that are closed after the test."""
    opened: list[Database] = []

    def make(url: str) -> Database:
        opened.append(Database(url))
        return opened[-1]

    yield make
    for database in opened:
        database.dispose()


@pytest.fixture
def sqlite_url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'moved.db'}"


def moved(source: Database, target: Database) -> list[str]:
    """Move everything; what was said."""
    said: list[str] = []
    source.dispose()
    move(str(source.engine.url), target.engine.url.render_as_string(hide_password=False), said.append)
    return said


@pytest.fixture(params=["to PostgreSQL", "back", "to another file"])
def pair(
    request: pytest.FixtureRequest, sqlite_url: str, tmp_path: Path, open_database: Callable[[str], Database]
) -> tuple[Database, Database]:
    """Where rows are, and where they are to go."""
    file = open_database(sqlite_url)
    if request.param == "to another file":
        return file, open_database(f"sqlite:///{tmp_path / 'other.db'}")
    server = open_database(request.getfixturevalue("empty_postgres_url"))
    return (file, server) if request.param == "to PostgreSQL" else (server, file)


@pytest.mark.services
def test_every_row_of_every_table_is_moved_and_whoever_adds_a_table_needs_to_do_nothing(
    pair: tuple[Database, Database],
) -> None:
    source, target = pair
    upgrade(source)
    fill(source)
    before = rows(source)
    assert before.keys() == Base.metadata.tables.keys()
    assert all(len(found) >= 2 for found in before.values())

    said = moved(source, target)
    assert rows(target) == before
    assert rows(source) == before
    assert revision(target) == head()
    assert said[0].startswith(f"{sum(map(len, before.values()))} rows of {len(before)} tables")


@pytest.mark.services
def test_numbers_text_bytes_and_what_json_says_are_the_same_to_the_last_bit(pair: tuple[Database, Database]) -> None:
    source, target = pair
    upgrade(source)
    fill(source)
    with source.write() as session:
        run = session.get_one(tables.Run, "1runs")
        run.seed, run.priority, run.started_at, run.finished_at = 2**62, -1, 0.1 + 0.2, 1e-300
        run.error, run.lost_by, run.device = "zwölf\n\U0001f916 'x' \"y\" \\", {"a": 1, "é": 2}, None
        session.get_one(tables.RunLogChunk, 1).lines = bytes(range(256)) * 1_000
        session.get_one(tables.Worker, "1workers").machine = None
        # JSON's null, which is not the database's.
        session.execute(text("UPDATE workers SET extensions = 'null' WHERE name = '1workers'"))
        session.execute(text("UPDATE runs SET lost_by = NULL WHERE id = '2runs'"))
        session.execute(text("""UPDATE experiments SET training = '{"a" :  1.0e2}' WHERE id = '1experiments'"""))
    before = rows(source)

    moved(source, target)
    assert rows(target) == before
    with target.read() as session:
        assert session.scalar(text("SELECT CAST(extensions AS TEXT) FROM workers WHERE name = '1workers'")) == "null"
        assert session.scalar(text("SELECT count(*) FROM runs WHERE lost_by IS NULL")) == 1
        kept = session.scalar(text("SELECT CAST(training AS TEXT) FROM experiments WHERE id = '1experiments'"))
        assert kept == '{"a" :  1.0e2}'


@pytest.mark.services
def test_what_is_numbered_by_the_database_goes_on_after_the_rows_that_came(pair: tuple[Database, Database]) -> None:
    source, target = pair
    upgrade(source)
    fill(source)
    moved(source, target)

    with target.write() as session:
        event = tables.RunEvent(run_id="1runs", level="info", message="after the move")
        session.add(event)
        session.flush()
        assert event.id == 3


@pytest.mark.services
def test_a_database_of_an_older_version_arrives_as_one_of_this(pair: tuple[Database, Database]) -> None:
    source, target = pair
    with rebuilding(source) as connection:
        bring(connection, "0009")
    fill(source)
    before = rows(source)

    moved(source, target)
    after = rows(target)
    assert revision(target) == head()
    assert {name: len(found) for name, found in before.items()}.items() <= {n: len(f) for n, f in after.items()}.items()


@pytest.mark.services
def test_a_text_that_the_other_database_refuses_is_named_and_nothing_is_left(
    sqlite_url: str, empty_postgres_url: str, open_database: Callable[[str], Database]
) -> None:
    source, target = open_database(sqlite_url), open_database(empty_postgres_url)
    upgrade(source)
    fill(source)
    with source.write() as session:
        # SQLite keeps text of any length.
        session.execute(text("UPDATE runs SET worker = :name WHERE id = '1runs'"), {"name": "x" * 121})

    with pytest.raises(UnfitRowsError, match=r"table runs .*120"):
        moved(source, target)
    assert revision(target) is None


def test_a_database_that_somebody_uses_is_not_moved_unless_told(
    sqlite_url: str, tmp_path: Path, open_database: Callable[[str], Database]
) -> None:
    source, target = open_database(sqlite_url), open_database(f"sqlite:///{tmp_path / 'other.db'}")
    upgrade(source)
    fill(source)
    # As a server that runs: it keeps its connections.
    with source.read() as session:
        session.execute(text("SELECT 1 FROM runs"))
    said: list[str] = []
    with pytest.raises(ConflictError, match="stop it first"):
        move(sqlite_url, str(target.engine.url), said.append)
    assert rows(target) == {}
    target.dispose()

    move(sqlite_url, str(target.engine.url), said.append, while_running=True)
    assert rows(target) == rows(source)


def test_nothing_is_moved_from_nowhere_or_onto_what_is_there(
    tmp_path: Path, sqlite_url: str, open_database: Callable[[str], Database]
) -> None:
    source, target = open_database(sqlite_url), open_database(f"sqlite:///{tmp_path / 'other.db'}")
    with pytest.raises(ConflictError, match="no database"):
        move(f"sqlite:///{tmp_path / 'none.db'}", sqlite_url, print)
    assert not (tmp_path / "none.db").exists()
    (tmp_path / "moved.db").touch()
    with pytest.raises(ConflictError, match="no tables"):
        moved(source, target)

    upgrade(source)
    fill(source)
    source.dispose()
    shutil.copy(tmp_path / "moved.db", tmp_path / "other.db")
    before = rows(target)
    target.dispose()
    with pytest.raises(ConflictError, match=r"not empty .*2 experiments"):
        moved(source, target)
    assert rows(target) == before


def test_a_database_that_a_first_start_made_counts_as_empty(
    sqlite_url: str, tmp_path: Path, open_database: Callable[[str], Database]
) -> None:
    source, target = open_database(sqlite_url), open_database(f"sqlite:///{tmp_path / 'other.db'}")
    upgrade(source)
    fill(source)
    upgrade(target)
    with target.write() as session:
        session.add(tables.Worker(name="heard of", queue="cpu", last_seen=1.0))
    target.dispose()

    moved(source, target)
    assert rows(target) == rows(source)


def test_a_kind_of_column_that_nobody_knows_is_refused_and_foreign_tables_are_left_out(
    sqlite_url: str, tmp_path: Path, open_database: Callable[[str], Database]
) -> None:
    source, target = open_database(sqlite_url), open_database(f"sqlite:///{tmp_path / 'other.db'}")
    upgrade(source)
    with source.write() as session:
        session.execute(text("CREATE TABLE somebody_elses (id INTEGER PRIMARY KEY)"))
    assert "somebody_elses is not Mapless's" in moved(source, target)[0]
    assert "somebody_elses" not in rows(target)

    with source.write() as session:
        session.execute(text(f"CREATE TABLE t{uuid.uuid4().hex} (at DATETIME)"))
    with pytest.raises(ServiceError, match="no table of Mapless has"):
        moved(source, open_database(f"sqlite:///{tmp_path / 'third.db'}"))
