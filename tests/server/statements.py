"""Counts what is asked of a database: how much an answer costs, in a number that no other work on the machine changes."""

from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import event

from server.audit.actor import current_actor
from server.database.engine import Database

_OF_THE_TRANSACTION = ("PRAGMA", "BEGIN", "SHOW")


@contextmanager
def statements(database: Database, *, of_requests: bool = False) -> Iterator[list[str]]:
    """The statements of the block, from all threads, or of requests alone; but for those that begin transactions."""
    found: list[str] = []

    def note(_connection: object, _cursor: object, statement: str, *_: object) -> None:
        # What sweeps meanwhile has no address.
        asked = not of_requests or current_actor().address != "command line"
        if asked and not statement.startswith(_OF_THE_TRANSACTION):
            found.append(statement)

    event.listen(database.engine, "before_cursor_execute", note)
    try:
        yield found
    finally:
        event.remove(database.engine, "before_cursor_execute", note)
