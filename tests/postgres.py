"""Databases of PostgreSQL for tests: used again, since to make or to drop one takes a second of its disk."""

import uuid
from concurrent.futures import Future, ThreadPoolExecutor

import psycopg

from server.database.engine import Database
from server.database.migrate import upgrade

HOST, PORT = "127.0.0.1", 5432

# What a test may have changed besides rows.
_SHAPE = """
SELECT md5(string_agg(line, ',' ORDER BY line)) FROM (
  SELECT format('%s %s %s %s', relname, attname, format_type(atttypid, atttypmod), attnotnull) AS line
    FROM pg_class JOIN pg_attribute ON attrelid = pg_class.oid
    WHERE relnamespace = 'public'::regnamespace AND attnum > 0
  UNION ALL SELECT format('%s %s', tgname, tgenabled) FROM pg_trigger WHERE NOT tgisinternal
  UNION ALL SELECT format('%s %s', conname, pg_get_constraintdef(oid)) FROM pg_constraint
    WHERE connamespace = 'public'::regnamespace
) AS lines"""
_LEAVE_IT = """
SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity
  WHERE datname = current_database() AND pid <> pg_backend_pid()"""
_COUNT_FROM_THE_START = """
SELECT setval(format('%I.%I', schemaname, sequencename)::regclass, start_value, false) FROM pg_sequences
  WHERE last_value IS NOT NULL"""
_TABLES = "SELECT quote_ident(relname) FROM pg_class WHERE relkind = 'r' AND relnamespace = 'public'::regnamespace"


def connect(name: str = "postgres") -> "psycopg.Connection[tuple[object, ...]]":
    """A connection to a database of the machine's server, on which every statement is a transaction."""
    return psycopg.connect(host=HOST, port=PORT, user="postgres", dbname=name, autocommit=True)


def url_of(name: str) -> str:
    """SQLAlchemy URL of a database."""
    return f"postgresql+psycopg://postgres@{HOST}:{PORT}/{name}"


def create(template: str = "template1") -> str:
    """The name of a new database."""
    name = f"mapless_test_{uuid.uuid4().hex[:12]}"
    with connect() as connection:
        connection.execute(f'CREATE DATABASE "{name}" TEMPLATE "{template}"'.encode())
        # No test crashes the server: that a commit is on its disk is nothing to wait for.
        connection.execute(f'ALTER DATABASE "{name}" SET synchronous_commit TO off'.encode())
    return name


def drop(name: str) -> None:
    """Drops a database, whoever is connected to it."""
    with connect() as connection:
        connection.execute(f'DROP DATABASE "{name}" WITH (FORCE)'.encode())


class Pool:
    """Databases with this version's tables and the rows that migrations put there; what comes back is emptied meanwhile.

    Every database is one test's at a time, and is as a new one when the next has it.
    """

    def __init__(self) -> None:
        self._template = create()
        database = Database(url_of(self._template))
        upgrade(database)
        database.dispose()
        with connect(self._template) as connection:
            self._shape = connection.execute(_SHAPE).fetchone()
            self._tables = [str(name) for (name,) in connection.execute(_TABLES)]
            self._rows = {table: self._copy_of(connection, table) for table in self._filled(connection)}
        self._thread = ThreadPoolExecutor(1)
        self._returning: list[Future[str]] = []

    def take(self) -> str:
        """The name of an empty database."""
        return self._returning.pop(0).result() if self._returning else create(self._template)

    def give_back(self, name: str) -> None:
        """A test is done with it."""
        self._returning.append(self._thread.submit(self._as_new, name))

    def close(self) -> None:
        """Drops them all."""
        for each in self._returning:
            drop(each.result())
        self._thread.shutdown()
        drop(self._template)

    def _as_new(self, name: str) -> str:
        with connect() as connection:
            connection.execute(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = %s AND pid <> pg_backend_pid()",
                (name,),
            )
        with connect(name) as connection:
            if connection.execute(_SHAPE).fetchone() == self._shape:
                # The audit's rows are kept by triggers, which are not asked here.
                connection.execute("SET session_replication_role TO replica")
                self._empty(connection)
                return name
        drop(name)
        return create(self._template)

    def _empty(self, connection: "psycopg.Connection[tuple[object, ...]]") -> None:
        # Where a TRUNCATE would wait for the disk, nothing here does.
        for table in self._filled(connection):
            connection.execute(f"DELETE FROM {table}".encode())
        connection.execute(_COUNT_FROM_THE_START)
        for table, rows in self._rows.items():
            with connection.cursor() as cursor, cursor.copy(f"COPY {table} FROM STDIN BINARY".encode()) as copy:
                copy.write(rows)

    def _filled(self, connection: "psycopg.Connection[tuple[object, ...]]") -> list[str]:
        query = " UNION ALL ".join(f"(SELECT '{table}' FROM {table} LIMIT 1)" for table in self._tables)
        return [str(table) for (table,) in connection.execute(query.encode())]

    @staticmethod
    def _copy_of(connection: "psycopg.Connection[tuple[object, ...]]", table: str) -> bytes:
        with connection.cursor() as cursor, cursor.copy(f"COPY {table} TO STDOUT BINARY".encode()) as copy:
            return b"".join(bytes(block) for block in copy)
