"""A transaction in which tables are dropped and made anew: all of it, or nothing."""

from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import Connection

from server.database.engine import Database
from server.errors import ServiceError


class HangingRowsError(ServiceError):
    """Rows would hang on rows that are not there; nothing was changed."""


@contextmanager
def rebuilding(database: Database) -> Iterator[Connection]:
    """A transaction that commits at the end of the block, its foreign keys checked then, and rolls back if the block raises.

    SQLite can't alter most of a table in place: Alembic copies it and drops the original, which would take along every row
    that hangs on it, were its foreign keys not switched off; and within a transaction that switch does nothing.

    Raises:
        HangingRowsError: SQLite alone; PostgreSQL refuses the statement itself.
    """
    with database.engine.connect() as connection:
        is_sqlite = database.engine.dialect.name == "sqlite"
        if is_sqlite:
            _switch_foreign_keys(connection, on=False)
        try:
            with connection.begin():
                yield connection
                if is_sqlite:
                    _check_foreign_keys(connection)
        finally:
            if is_sqlite:
                _switch_foreign_keys(connection, on=True)


def _switch_foreign_keys(connection: Connection, *, on: bool) -> None:
    raw = connection.connection.dbapi_connection
    assert raw is not None
    # Past SQLAlchemy, which would begin a transaction first.
    raw.execute(f"PRAGMA foreign_keys={'ON' if on else 'OFF'}")


def _check_foreign_keys(connection: Connection) -> None:
    hanging = sorted({row[0] for row in connection.exec_driver_sql("PRAGMA foreign_key_check")})
    if hanging:
        raise HangingRowsError(
            f"Rows of {', '.join(hanging)} hang on rows that are not there, so nothing was changed. Restore a backup, or "
            "delete them: `PRAGMA foreign_key_check` in the sqlite3 shell lists them."
        )
