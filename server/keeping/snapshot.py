"""One state of a database, to be read at leisure while others write."""

import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from sqlalchemy import Connection, make_url, text

from server.database.engine import Database


@contextmanager
def snapshot(database: Database, folder: Path) -> Iterator[Connection]:
    """The database as it is now.

    PostgreSQL shows one state to a transaction. SQLite's file is copied into `folder` first, by its online backup: that
    takes as long as the disk needs, and a reader of minutes would let the log of what is written meanwhile grow and grow.
    """
    if database.engine.dialect.name == "postgresql":
        options = {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}
        with database.engine.connect().execution_options(**options) as connection, connection.begin():
            yield connection
        return
    with tempfile.TemporaryDirectory(dir=folder, prefix=".mapless-") as temporary:
        path = Path(temporary) / "mapless.db"
        with (
            closing(sqlite3.connect(f"file:{_path(database)}?mode=ro", uri=True)) as source,
            closing(sqlite3.connect(path)) as copy,
        ):
            # All pages at once: a copy in parts begins anew whenever somebody writes in between.
            source.backup(copy)
        copied = Database(f"sqlite:///{path}")
        try:
            with copied.engine.connect() as connection:
                yield connection
        finally:
            copied.dispose()


def exists(url: str) -> bool:
    """Whether there is a database to be opened; to open SQLite's would make it."""
    parsed = make_url(url)
    return parsed.get_backend_name() != "sqlite" or (parsed.database is not None and Path(parsed.database).is_file())


def size(database: Database) -> int:
    """Bytes that the database takes, about."""
    if database.engine.dialect.name == "sqlite":
        return _path(database).stat().st_size
    with database.read() as session:
        return int(session.scalar(text("SELECT pg_database_size(current_database())")) or 0)


def in_use(database: Database) -> bool:
    """Whether somebody else has the database open: a server that runs always has."""
    if database.engine.dialect.name == "postgresql":
        others = text(
            "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() "
            "AND pid <> pg_backend_pid() AND backend_type = 'client backend'"
        )
        database.dispose()
        with database.read() as session:
            return bool(session.scalar(others))
    database.dispose()
    path = _path(database)
    if not path.exists():
        return False
    with closing(sqlite3.connect(path, timeout=0.0, isolation_level=None)) as connection:
        try:
            # Whoever has opened a database with a write-ahead log holds a lock that this needs for itself.
            connection.execute("PRAGMA locking_mode=EXCLUSIVE")
            connection.execute("BEGIN EXCLUSIVE")
            connection.execute("ROLLBACK")
        except sqlite3.OperationalError:
            return True
    return False


def _path(database: Database) -> Path:
    name = database.engine.url.database
    assert name is not None
    return Path(name)
