"""The migrations lead from nothing to exactly the tables of the models, on both databases."""

from collections.abc import Iterator

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, text

from server.database.engine import Database
from server.database.migrate import IncompatibleDatabaseError, head, migration_config, upgrade
from server.database.tables import Base


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    database = Database(database_url)
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
