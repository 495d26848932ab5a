"""`mapless move`: takes every row from one database to another one, of either kind; the store stays as it is."""

import tempfile
from collections.abc import Callable
from pathlib import Path

from server.database.engine import Database
from server.database.migrate import revision, tear_down
from server.database.rebuilding import rebuilding
from server.errors import ConflictError
from server.keeping.copying import check_revision, fill, holds
from server.keeping.rows import read_rows, shapes
from server.keeping.snapshot import exists, in_use, snapshot


def move(source_url: str, target_url: str, say: Callable[[str], None], *, while_running: bool = False) -> None:
    """Copy a database, and compare the copy with it; the source stays as it is.

    Args:
        source_url: SQLAlchemy URL of the database that is read.
        target_url: SQLAlchemy URL of the one that is filled; it must be empty.
        say: told what was done.
        while_running: a server may have the source open: what it writes from now on is not taken over.

    Raises:
        ConflictError: the source is not there or in use, or the target is not empty; nothing was changed.
        ServiceError: a row can't be taken over; nothing was changed.
    """
    if not exists(source_url):
        raise ConflictError("There is no database to read from.")
    source, target = Database(source_url), Database(target_url)
    try:
        found = check_revision(revision(source), "The source")
        if not while_running and in_use(source):
            raise ConflictError("A server runs on the source: stop it first, or --while-running leaves out what it writes.")
        if in_use(target):
            raise ConflictError("A server runs on the target: stop it first.")
        there = revision(target)
        if there is not None:
            check_revision(there, "The target")
            rest = holds(target)
            if rest is not None:
                raise ConflictError(f"The target is not empty ({rest}): name another database.")
        with snapshot(source, Path(tempfile.gettempdir())) as read, rebuilding(target) as written:
            if there is not None:
                tear_down(written)
            moved = fill(
                written, found, {shape.name: shape for shape in shapes(read)}, lambda shape: read_rows(read, shape), say
            )
    finally:
        source.dispose()
        target.dispose()
    say(f"{sum(one.rows for one in moved.values())} rows of {len(moved)} tables were taken over and compared.")
    say("Name the new one in MAPLESS_DATABASE_URL before the next start; checkpoints stay where they are.")
