"""The migrations lead from nothing to exactly the tables of the models, on both databases."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, text

from server.database.engine import Database
from server.database.migrate import IncompatibleDatabaseError, head, migration_config, upgrade
from server.database.rebuilding import HangingRowsError
from server.database.tables import Base
from tests.server.filling import fill, rows


@pytest.fixture
def database(empty_database_url: str) -> Iterator[Database]:
    database = Database(empty_database_url)
    yield database
    database.dispose()


def test_migrations_and_models_agree(database: Database) -> None:
    upgrade(database)

    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True, "compare_server_default": True})
        assert compare_metadata(context, Base.metadata) == []


def test_the_newest_migration_is_the_one_with_the_highest_number(database: Database) -> None:
    assert head() == ScriptDirectory.from_config(migration_config(database)).get_current_head()


def test_a_second_start_finds_nothing_to_do(database: Database) -> None:
    upgrade(database)
    with database.write() as session:
        session.execute(text("INSERT INTO workers (name, queue, last_seen) VALUES ('kept', 'cpu', 1.0)"))
    upgrade(database)

    with database.read() as session:
        assert session.scalar(text("SELECT name FROM workers")) == "kept"


def test_the_way_back_leaves_nothing(database: Database) -> None:
    upgrade(database)
    command.downgrade(migration_config(database), "base")

    assert inspect(database.engine).get_table_names() == ["alembic_version"]


def test_a_database_of_a_newer_version_is_refused(database: Database) -> None:
    upgrade(database)
    with database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))

    with pytest.raises(IncompatibleDatabaseError, match="newer version"):
        upgrade(database)


def revisions(database: Database) -> list[str]:
    scripts = ScriptDirectory.from_config(migration_config(database))
    return [script.revision for script in scripts.walk_revisions()][::-1]


def kept(before: dict[str, list[dict[str, Any]]], after: dict[str, list[dict[str, Any]]]) -> None:
    """Every row of a table that is in both is there, with what its columns held."""
    for name in before.keys() & after.keys():
        assert len(after[name]) == len(before[name]), name
        for old, new in zip(before[name], after[name], strict=True):
            for column in old.keys() & new.keys():
                assert new[column] == old[column], (name, column)


def test_no_migration_loses_a_row_on_its_way_up_or_down(database: Database) -> None:
    """SQLite can alter most of a table by copying it only: dropping the original must not take along what hangs on it."""
    config = migration_config(database)
    for revision in revisions(database):
        before = rows(database)
        command.upgrade(config, revision)
        kept(before, rows(database))
        fill(database)
    for revision in revisions(database)[-2::-1]:
        before = rows(database)
        command.downgrade(config, revision)
        kept(before, rows(database))


def test_after_a_migration_what_hangs_on_a_row_goes_with_it_again(database: Database) -> None:
    upgrade(database)
    fill(database)
    with database.write() as session:
        session.execute(text("DELETE FROM experiments"))

    assert rows(database)["runs"] == []


def test_a_migration_that_leaves_rows_hanging_on_nothing_is_taken_back(tmp_path: Path) -> None:
    """On SQLite; PostgreSQL refuses the statement itself."""
    database = Database(f"sqlite:///{tmp_path / 'test.db'}")
    upgrade(database)
    fill(database)
    with database.engine.connect() as connection:
        # As a fault in an earlier version might have left it.
        assert connection.connection.dbapi_connection is not None
        connection.connection.dbapi_connection.execute("PRAGMA foreign_keys=OFF")
        connection.execute(text("DELETE FROM experiments"))
        connection.commit()
        connection.connection.dbapi_connection.execute("PRAGMA foreign_keys=ON")

    with pytest.raises(HangingRowsError, match="runs"):
        command.downgrade(migration_config(database), "-1")
    assert len(rows(database)["runs"]) == 2
    with database.read() as session:
        assert session.scalar(text("SELECT version_num FROM alembic_version")) == head()
    database.dispose()
