"""The database: one engine, and the two kinds of transaction that everything goes through.

SQLite runs in WAL mode, where readers and the one writer don't wait for one another. A transaction that means to write
takes the write lock at its start (BEGIN IMMEDIATE): one that started as a reader could only fail when it upgrades, where
this one waits. Within this process writers queue up in front of it: SQLite's own lock is polled, and where forty threads
poll, chance decides who waits until the time-out.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from sqlite3 import Connection as SqliteConnection
from typing import TYPE_CHECKING, Any

from pydantic_core import from_json
from sqlalchemy import Connection, create_engine, event, make_url, text
from sqlalchemy.engine import Engine
from sqlalchemy.exc import DataError, InterfaceError, OperationalError
from sqlalchemy.exc import TimeoutError as NoConnectionError
from sqlalchemy.orm import Session
from sqlalchemy.pool import ConnectionPoolEntry

from server.database.fair_lock import FairLock
from server.database.tables import Base
from server.database.writes import Writes
from server.errors import DatabaseAwayError, DatabaseBusyError, InvalidRequestError, ServiceError
from server.outage import RETRY_AFTER, Outage

if TYPE_CHECKING:
    from psycopg import Connection as PsycopgConnection

# How long a writer waits for another one; a transaction of ours takes milliseconds.
_BUSY_TIMEOUT_MS = 10_000
# How long one waits in the queue of this process: several transactions of other programs' length.
_TURN_SECONDS = 30.0
# FastAPI runs synchronous endpoints on up to 40 threads.
_POOL_SIZE = 10
_POOL_OVERFLOW = 40

# Of a database server that neither answers nor refuses: libpq's names, in seconds but for the last one. A query may take its
# time; what is sent to a machine that is gone is not acknowledged.
_PATIENCE = {
    "connect_timeout": 5,
    "keepalives_idle": 10,
    "keepalives_interval": 5,
    "keepalives_count": 3,
    "tcp_user_timeout": 20_000,
}

_READ_ONLY = "mapless_read_only"


class UnusableDatabaseError(ServiceError):
    """The database answers, but can't hold what the service keeps."""


class Database:
    """An engine with its transactions. Thread-safe; sessions are not, and live within one `read` or `write`.

    A database server that has answered once may go away: from then on transactions raise DatabaseAwayError until it is back.
    """

    def __init__(self, url: str) -> None:
        self.engine = _create_engine(url)
        self._outage = Outage(f"The database {self.engine.url.render_as_string(hide_password=True)}")
        # Until then whoever starts with it tells of it.
        self._answered = False
        event.listen(self.engine, "checkout", self._on_checkout)
        read_only: dict[str, Any] = {_READ_ONLY: True}
        if self.engine.dialect.name == "postgresql":
            # All of a block sees one state; in SQLite every transaction does.
            read_only |= {"postgresql_readonly": True, "isolation_level": "REPEATABLE READ"}
        self.writes = Writes(self.engine, Base.metadata)
        self._turn = FairLock() if self.engine.dialect.name == "sqlite" else None
        self._read_engine = self.engine.execution_options(**read_only)

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A consistent view that can't write: an attempt to is an error of the database.

        Raises:
            DatabaseAwayError: the database can't be reached.
            InvalidRequestError: it is asked with a text that holds a NUL.
        """
        with self._answering(), Session(self._read_engine, expire_on_commit=False, autoflush=False) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """A transaction that commits at the end of the block and rolls back if the block raises.

        Raises:
            DatabaseAwayError: the database can't be reached; nothing was written, but for a commit whose answer was lost.
            DatabaseBusyError: other writers took too long.
            InvalidRequestError: as `read`.
        """
        turn = self._turn.held(_TURN_SECONDS) if self._turn else nullcontext()
        with (
            turn,
            self._answering(),
            self.writes.counted(),
            Session(self.engine, expire_on_commit=False) as session,
            session.begin(),
        ):
            yield session

    def ping(self) -> None:
        """Ask the database for an answer.

        Raises:
            DatabaseAwayError: there is none.
            sqlalchemy.exc.SQLAlchemyError: it can't be used.
        """
        with self.read() as session:
            session.execute(text("SELECT 1"))

    def dispose(self) -> None:
        """Close every connection."""
        self.engine.dispose()

    @contextmanager
    def _answering(self) -> Iterator[None]:
        """Tells a database that is away from one that refuses something."""
        if not self._outage.may_ask():
            raise _away()
        try:
            yield
        except NoConnectionError as error:
            raise DatabaseBusyError(
                "All connections to the database are in use: try again in a moment.", retry_after=RETRY_AFTER
            ) from error
        except DataError as error:
            if self.engine.dialect.name == "postgresql" and "NUL" in str(error.orig):
                raise InvalidRequestError(
                    "A text of this request holds a NUL character, which the database can't keep."
                ) from error
            raise
        except (OperationalError, InterfaceError) as error:
            if not self._answered or self.engine.dialect.name == "sqlite":
                raise
            if error.connection_invalidated:
                # Whether it was the connection or the database, the next one to connect finds out.
                raise _away() from error
            if error.statement is None and getattr(error.orig, "sqlstate", None) is None:
                self._outage.gone(str(error.orig).splitlines()[0])
                raise _away() from error
            raise

    def _on_checkout(self, *_: object) -> None:
        """A connection was made, or has answered."""
        self._answered = True
        self._outage.back()


def _away() -> DatabaseAwayError:
    return DatabaseAwayError("The database can't be reached now: try again in a moment.", retry_after=RETRY_AFTER)


def _check_encoding(connection: "PsycopgConnection[Any]", _record: ConnectionPoolEntry) -> None:
    encoding = connection.info.parameter_status("server_encoding")
    if encoding != "UTF8":
        raise UnusableDatabaseError(
            f"The database {connection.info.dbname} keeps text as {encoding}, which does not hold every character: "
            f"create one with `createdb --encoding UTF8 --template template0 ...`, and name it in MAPLESS_DATABASE_URL."
        )


def _lower(text: str | None) -> str | None:
    return None if text is None else text.lower()


def read_json(text: str | bytes) -> Any:
    """What a column of JSON holds: pages read thousands of numbers from there, which this reads four times as quickly."""
    try:
        return from_json(text)
    except ValueError:
        # Half a surrogate pair, which JSON may hold and Python's own reads.
        return json.loads(text)


def _create_engine(url: str) -> Engine:
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite":
        patience = {name: value for name, value in _PATIENCE.items() if name not in parsed.query}
        engine = create_engine(
            url,
            pool_size=_POOL_SIZE,
            max_overflow=_POOL_OVERFLOW,
            pool_pre_ping=True,
            connect_args=patience,
            json_deserializer=read_json,
        )
        # Ahead of SQLAlchemy's own first look, which does not understand what such a database answers.
        event.listen(engine, "connect", _check_encoding, insert=True)
        return engine
    if parsed.database:
        Path(parsed.database).parent.mkdir(parents=True, exist_ok=True)
    engine = create_engine(url, pool_size=_POOL_SIZE, max_overflow=_POOL_OVERFLOW, json_deserializer=read_json)

    @event.listens_for(engine, "connect")
    def _configure(connection: SqliteConnection, _record: ConnectionPoolEntry) -> None:
        # The driver would begin transactions by itself, deferred ones; _begin does it instead.
        connection.isolation_level = None
        # SQLite's own knows no letters but the 26 of ASCII.
        connection.create_function("lower", 1, _lower, deterministic=True)
        # With less, the last commits before a power cut may not be there after it.
        for pragma in ("journal_mode=WAL", "synchronous=FULL", f"busy_timeout={_BUSY_TIMEOUT_MS}", "foreign_keys=ON"):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        read_only = bool(connection.get_execution_options().get(_READ_ONLY))
        connection.exec_driver_sql(f"PRAGMA query_only={int(read_only)}")
        connection.exec_driver_sql("BEGIN" if read_only else "BEGIN IMMEDIATE")

    return engine
