"""How often each table was written: what an answer was made of is the same as long as these numbers are.

Counted in the process that serves, whose transactions are the only ones that change what it shows.
"""

import re
import threading
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Any

from sqlalchemy import MetaData, event
from sqlalchemy.engine import Engine

_WRITES = re.compile(r'\s*(INSERT\s+INTO|INSERT\s+OR\s+\w+\s+INTO|UPDATE|DELETE\s+FROM)\s+"?(\w+)', re.IGNORECASE)
_READS = re.compile(
    r"\s*(SELECT|VALUES|PRAGMA|BEGIN|COMMIT|ROLLBACK|SAVEPOINT|RELEASE|SHOW|SET|LOCK|EXPLAIN|ANALYZE|VACUUM)", re.IGNORECASE
)

_written: ContextVar[set[str] | None] = ContextVar("tables that the transaction has written", default=None)


class Writes:
    """Counts committed transactions by the tables that they wrote. Thread-safe.

    Args:
        engine: whose statements are looked at.
        metadata: of its tables: what is deleted from one may be deleted, or changed, from those that point to it.
    """

    def __init__(self, engine: Engine, metadata: MetaData) -> None:
        self._metadata = metadata
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()
        self._pointing = cache(self._pointing_to)
        event.listen(engine, "before_cursor_execute", self._note)

    def of(self, *tables: str) -> tuple[int, ...]:
        """How often each of these tables was written. Read before the tables: what is written meanwhile counts as new."""
        with self._lock:
            return tuple(self._counts[table] for table in tables)

    @contextmanager
    def counted(self) -> Iterator[None]:
        """Count what the transaction in this block writes, once it has ended."""
        names: set[str] = set()
        token = _written.set(names)
        try:
            yield
        finally:
            _written.reset(token)
            with self._lock:
                self._counts.update(names)

    def _note(self, _connection: Any, _cursor: Any, statement: str, *_: Any) -> None:
        names = _written.get()
        if names is None:
            return
        if (write := _WRITES.match(statement)) is not None:
            names.update(self._pointing(write[2]) if write[1].upper().startswith("DELETE") else (write[2],))
        elif _READS.match(statement) is None:
            # Whatever it is: all may have changed.
            names.update(self._metadata.tables)

    def _pointing_to(self, table: str) -> Collection[str]:
        """The table, and all that a deletion may reach from there."""
        found = {table}
        while True:
            more = {
                each.name
                for each in self._metadata.tables.values()
                if any(key.column.table.name in found for key in each.foreign_keys)
            }
            if more <= found:
                return found
            found |= more
