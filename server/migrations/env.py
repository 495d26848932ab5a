"""Alembic's entry point: runs migrations on the connection or the database that it is handed, all in one transaction."""

from alembic import context
from sqlalchemy import Connection

from server.database.engine import Database
from server.database.rebuilding import rebuilding
from server.database.tables import Base


def run() -> None:
    given = context.config.attributes.get("connection")
    if given is not None:
        assert isinstance(given, Connection)
        migrate(given)
        return
    database = context.config.attributes["database"]
    assert isinstance(database, Database)
    with rebuilding(database) as connection:
        migrate(connection)


def migrate(connection: Connection) -> None:
    context.configure(connection=connection, target_metadata=Base.metadata, render_as_batch=True, compare_type=True)
    context.run_migrations()


run()
