"""Alembic's entry point: runs migrations on the database that it is handed."""

from alembic import context

from server.database.engine import Database
from server.database.tables import Base


def run() -> None:
    database = context.config.attributes["database"]
    assert isinstance(database, Database)
    with database.engine.begin() as connection:
        # SQLite can't alter most of a table in place: Alembic copies it.
        context.configure(connection=connection, target_metadata=Base.metadata, render_as_batch=True, compare_type=True)
        context.run_migrations()


run()
