"""Alembic's entry point: runs migrations on the database that it is handed, all in one transaction."""

from alembic import context
from sqlalchemy import Connection

from server.database.engine import Database
from server.database.migrate import IncompatibleDatabaseError
from server.database.tables import Base


def run() -> None:
    database = context.config.attributes["database"]
    assert isinstance(database, Database)
    with database.engine.connect() as connection:
        is_sqlite = database.engine.dialect.name == "sqlite"
        if is_sqlite:
            # SQLite can't alter most of a table in place: Alembic copies it and drops the original, which would take along
            # every row that hangs on it. Within a transaction this switch does nothing.
            switch_foreign_keys(connection, on=False)
        try:
            with connection.begin():
                context.configure(
                    connection=connection, target_metadata=Base.metadata, render_as_batch=True, compare_type=True
                )
                context.run_migrations()
                if is_sqlite:
                    check_foreign_keys(connection)
        finally:
            if is_sqlite:
                switch_foreign_keys(connection, on=True)


def switch_foreign_keys(connection: Connection, *, on: bool) -> None:
    raw = connection.connection.dbapi_connection
    assert raw is not None
    # Past SQLAlchemy, which would begin a transaction first.
    raw.execute(f"PRAGMA foreign_keys={'ON' if on else 'OFF'}")


def check_foreign_keys(connection: Connection) -> None:
    hanging = sorted({row[0] for row in connection.exec_driver_sql("PRAGMA foreign_key_check")})
    if hanging:
        raise IncompatibleDatabaseError(
            f"Rows of {', '.join(hanging)} hang on rows that are not there, so nothing was changed. Restore a backup, or "
            "delete them: `PRAGMA foreign_key_check` in the sqlite3 shell lists them."
        )


run()
