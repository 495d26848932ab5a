"""Transactions: readers can't write, writers wait for one another, and a failed block leaves nothing."""

import json
import threading
from collections.abc import Iterator
from contextlib import nullcontext

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from server.database import tables
from server.database.engine import Database, read_json
from server.errors import InvalidRequestError


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    database = Database(database_url)
    yield database
    database.dispose()


def names(database: Database) -> list[str]:
    with database.read() as session:
        return sorted(worker.name for worker in session.query(tables.Worker))


def test_a_reader_cannot_write(database: Database) -> None:
    with database.read() as session:
        session.add(tables.Worker(name="w", queue="cpu", last_seen=0.0))
        with pytest.raises(DBAPIError, match=r"read-?only"):
            session.flush()

    with database.write() as session:
        session.add(tables.Worker(name="allowed again", queue="cpu", last_seen=0.0))
    assert names(database) == ["allowed again"]


def test_a_reader_sees_one_state(database: Database) -> None:
    with database.read() as session:
        assert session.query(tables.Worker).count() == 0
        with database.write() as other:
            other.add(tables.Worker(name="w", queue="cpu", last_seen=0.0))
        assert session.query(tables.Worker).count() == 0

    assert names(database) == ["w"]


def test_a_block_that_raises_leaves_nothing(database: Database) -> None:
    def fail_midway() -> None:
        with database.write() as session:
            session.add(tables.Worker(name="w", queue="cpu", last_seen=0.0))
            session.flush()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_midway()

    assert names(database) == []


def test_writers_wait_for_one_another(database: Database) -> None:
    """Eight threads count in one row; deferred transactions would lose counts or fail."""
    with database.write() as session:
        session.add(tables.Worker(name="counter", queue="cpu", last_seen=0.0))

    def count() -> None:
        for _ in range(20):
            with database.write() as session:
                session.get_one(tables.Worker, "counter", with_for_update=True).last_seen += 1

    threads = [threading.Thread(target=count) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    with database.read() as session:
        assert session.get_one(tables.Worker, "counter").last_seen == 160


def test_what_was_committed_is_on_the_disk(database: Database) -> None:
    """A launch that was answered is there after a power cut, and so is what a worker no longer keeps in its spool."""
    asked, safe = "PRAGMA synchronous", "2"
    if database.engine.dialect.name == "postgresql":
        asked, safe = "SHOW synchronous_commit", "on"
        # The tests' databases wait for no disk (`tests.postgres`): this one becomes an ordinary one.
        with database.write() as session:
            session.execute(text(f'ALTER DATABASE "{database.engine.url.database}" RESET synchronous_commit'))
        database.engine.dispose()
    with database.write() as session:
        assert str(session.scalar(text(asked))) == safe


def test_an_experiment_takes_everything_along_when_it_goes(database: Database) -> None:
    with database.write() as session:
        session.add(tables.Experiment(id="e", name="e", training={}, runs=[tables.Run(id="r", seed=0)]))
        session.flush()
        session.add(tables.RunEvent(run_id="r", level="info", message="m"))
        session.add(tables.MetricRow(run_id="r", seq=1, step=1, wall_time=0.0, values={"x": 1.0}))
        session.add(tables.Checkpoint(id="c", run_id="r", step=1, size=1, sha256="0"))
    with database.write() as session:
        session.delete(session.get_one(tables.Experiment, "e"))

    with database.read() as session:
        for table in (tables.Run, tables.RunEvent, tables.MetricRow, tables.Checkpoint):
            assert session.query(table).count() == 0


def test_a_text_that_the_database_cannot_keep_is_the_askers_fault(database: Database) -> None:
    refused = pytest.raises(InvalidRequestError) if database.engine.dialect.name == "postgresql" else nullcontext()
    with refused, database.read() as session:
        assert session.get(tables.Experiment, "a\0b") is None


@pytest.mark.parametrize(
    "text",
    ['{"a": [1, 2.5, null, 1e-300, 12345678901234567890], "b": NaN}', '"\\ud800"', '{"a": 0.1, "a": 0.30000000000000004}'],
)
def test_columns_of_json_are_read_as_python_reads_them(text: str) -> None:
    assert repr(read_json(text)) == repr(json.loads(text))
