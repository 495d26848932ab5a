"""What tests of PostgreSQL stand on: a database that comes back is as a new one for the next test."""

from collections.abc import Iterator

import pytest

from tests import postgres
from tests.conftest import POSTGRES, require_service

pytestmark = pytest.mark.services


@pytest.fixture
def pool() -> Iterator[postgres.Pool]:
    require_service("PostgreSQL", *POSTGRES)
    pool = postgres.Pool()
    yield pool
    pool.close()


def test_rows_and_counts_of_the_last_test_are_gone_and_the_migrations_rows_are_there(pool: postgres.Pool) -> None:
    first = pool.take()
    with postgres.connect(first) as connection:
        projects = connection.execute("SELECT * FROM projects").fetchall()
        connection.execute("DELETE FROM projects")
        connection.execute("INSERT INTO audit_entries (at, actor, address, action) VALUES (1, 'a', 'b', 'c')")
        # Who is still connected is cut off.
        pool.give_back(first)
        second = pool.take()
    assert second == first
    with postgres.connect(second) as connection:
        assert connection.execute("SELECT * FROM projects").fetchall() == projects
        assert connection.execute("SELECT count(*) FROM audit_entries").fetchone() == (0,)
        connection.execute("INSERT INTO audit_entries (at, actor, address, action) VALUES (1, 'a', 'b', 'c')")
        assert connection.execute("SELECT id FROM audit_entries").fetchone() == (1,)
    pool.give_back(second)


@pytest.mark.parametrize(
    "change", ["ALTER TABLE runs ADD COLUMN more int", "DROP TRIGGER audit_entries_change ON audit_entries"]
)
def test_one_whose_tables_have_changed_is_not_used_again(pool: postgres.Pool, change: str) -> None:
    first = pool.take()
    with postgres.connect(first) as connection:
        connection.execute(change.encode())
    pool.give_back(first)
    second = pool.take()
    assert second != first
    pool.give_back(second)
