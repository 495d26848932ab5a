"""The database: one engine, and the two kinds of transaction that everything goes through.

SQLite runs in WAL mode, where readers and the one writer don't wait for one another. A transaction that means to write
takes the write lock at its start (BEGIN IMMEDIATE): one that started as a reader could only fail when it upgrades, where
this one waits. Within this process writers queue up in front of it: SQLite's own lock is polled, and where forty threads
poll, chance decides who waits until the time-out.
"""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from sqlite3 import Connection as SqliteConnection
from typing import TYPE_CHECKING, Any

from sqlalchemy import Connection, create_engine, event, make_url, text
from sqlalchemy.engine import Engine
from sqlalchemy.orm import Session
from sqlalchemy.pool import ConnectionPoolEntry

from server.database.fair_lock import FairLock
from server.database.tables import Base
from server.database.writes import Writes
from server.errors import ServiceError

if TYPE_CHECKING:
    from psycopg import Connection as PsycopgConnection

# How long a writer waits for another one; a transaction of ours takes milliseconds.
_BUSY_TIMEOUT_MS = 10_000
# How long one waits in the queue of this process: several transactions of other programs' length.
_TURN_SECONDS = 30.0
# FastAPI runs synchronous endpoints on up to 40 threads.
_POOL_SIZE = 10
_POOL_OVERFLOW = 40

_READ_ONLY = "mapless_read_only"


class UnusableDatabaseError(ServiceError):
    """The database answers, but can't hold what the service keeps."""


class Database:
    """An engine with its transactions. Thread-safe; sessions are not, and live within one `read` or `write`."""

    def __init__(self, url: str) -> None:
        self.engine = _create_engine(url)
        read_only: dict[str, Any] = {_READ_ONLY: True}
        if self.engine.dialect.name == "postgresql":
            # All of a block sees one state; in SQLite every transaction does.
            read_only |= {"postgresql_readonly": True, "isolation_level": "REPEATABLE READ"}
        self.writes = Writes(self.engine, Base.metadata)
        self._turn = FairLock() if self.engine.dialect.name == "sqlite" else None
        self._read_engine = self.engine.execution_options(**read_only)

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A consistent view that can't write: an attempt to is an error of the database."""
        with Session(self._read_engine, expire_on_commit=False, autoflush=False) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """A transaction that commits at the end of the block and rolls back if the block raises.

        Raises:
            DatabaseBusyError: other writers took too long.
        """
        turn = self._turn.held(_TURN_SECONDS) if self._turn else nullcontext()
        with turn, self.writes.counted(), Session(self.engine, expire_on_commit=False) as session, session.begin():
            yield session

    def ping(self) -> None:
        """Ask the database for an answer.

        Raises:
            sqlalchemy.exc.SQLAlchemyError: there is none.
        """
        with self.read() as session:
            session.execute(text("SELECT 1"))

    def dispose(self) -> None:
        """Close every connection."""
        self.engine.dispose()


def _check_encoding(connection: "PsycopgConnection[Any]", _record: ConnectionPoolEntry) -> None:
    encoding = connection.info.parameter_status("server_encoding")
    if encoding != "UTF8":
        raise UnusableDatabaseError(
            f"The database {connection.info.dbname} keeps text as {encoding}, which does not hold every character: "
            f"create one with `createdb --encoding UTF8 --template template0 ...`, and name it in MAPLESS_DATABASE_URL."
        )


def _lower(text: str | None) -> str | None:
    return None if text is None else text.lower()


def _create_engine(url: str) -> Engine:
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite":
        engine = create_engine(url, pool_size=_POOL_SIZE, max_overflow=_POOL_OVERFLOW, pool_pre_ping=True)
        # Ahead of SQLAlchemy's own first look, which does not understand what such a database answers.
        event.listen(engine, "connect", _check_encoding, insert=True)
        return engine
    if parsed.database:
        Path(parsed.database).parent.mkdir(parents=True, exist_ok=True)
    engine = create_engine(url, pool_size=_POOL_SIZE, max_overflow=_POOL_OVERFLOW)

    @event.listens_for(engine, "connect")
    def _configure(connection: SqliteConnection, _record: ConnectionPoolEntry) -> None:
        # The driver would begin transactions by itself, deferred ones; _begin does it instead.
        connection.isolation_level = None
        # SQLite's own knows no letters but the 26 of ASCII.
        connection.create_function("lower", 1, _lower, deterministic=True)
        for pragma in ("journal_mode=WAL", "synchronous=NORMAL", f"busy_timeout={_BUSY_TIMEOUT_MS}", "foreign_keys=ON"):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        read_only = bool(connection.get_execution_options().get(_READ_ONLY))
        connection.exec_driver_sql(f"PRAGMA query_only={int(read_only)}")
        connection.exec_driver_sql("BEGIN" if read_only else "BEGIN IMMEDIATE")

    return engine
