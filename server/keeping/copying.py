"""Fills a database with rows of another one, of whichever kind and version; within one transaction, and compared after."""

from collections.abc import Callable, Iterator, Mapping

from sqlalchemy import Connection, delete, func, select
from sqlalchemy import table as sql_table

from server.database.engine import Database
from server.database.migrate import bring, head, known_revisions
from server.errors import ConflictError, ServiceError
from server.keeping.rows import Row, Shape, Sum, line_of, shapes, summed, write_rows

# What a server and its workers write before anybody has used them.
_OF_A_START = {"projects": 1}
_HEARD_OF = "workers"


class UnlikeError(ServiceError):
    """What was written is not what was read; nothing was changed."""


def check_revision(found: str | None, place: str) -> str:
    """The revision of tables that this version can read.

    Raises:
        ConflictError: it can't.
    """
    if found is None:
        raise ConflictError(f"{place} has no tables of Mapless.")
    if found not in known_revisions():
        raise ConflictError(f"{place} was made by a newer version of Mapless (tables {found}, this one has {head()}).")
    return found


def holds(database: Database) -> str | None:
    """What a database holds besides what a first start writes, in words; None where that is nothing."""
    with database.engine.connect() as connection:
        counts = {shape.name: _count(connection, shape.name) for shape in shapes(connection)}
    used = {name: count for name, count in counts.items() if name != _HEARD_OF and count > _OF_A_START.get(name, 0)}
    return ", ".join(f"{count} {name}" for name, count in used.items()) or None


def fill(
    connection: Connection,
    revision: str,
    tables: Mapping[str, Shape],
    rows: Callable[[Shape], Iterator[Row]],
    say: Callable[[str], None],
) -> dict[str, Sum]:
    """Fill a database without tables, within the caller's transaction (`rebuilding`), and bring it to this version's.

    Args:
        connection: to it.
        revision: of the tables that are read.
        tables: those that are read, by name.
        rows: reads all rows of one.
        say: told of tables that are not Mapless's, and are left out.

    Returns:
        What was read of each table; what is there now is the same.

    Raises:
        ConflictError: a table is missing, or is another one.
        UnfitRowsError: a row does not fit into its table here.
        UnlikeError: a table does not hold what was read.
    """
    bring(connection, revision)
    empty = shapes(connection)
    for shape in empty:
        if tables.get(shape.name) != shape:
            raise ConflictError(f"The table {shape.name} is not that of a database with tables {revision}.")
    for name in tables.keys() - {shape.name for shape in empty}:
        say(f"The table {name} is not Mapless's: left out.")
    for shape in reversed(empty):
        # Written by a migration: the rows that come have it. The log of what was done refuses to be asked.
        if _count(connection, shape.name):
            connection.execute(delete(sql_table(shape.name)))
    read: dict[str, Sum] = {}
    # In the order of the columns there, which may be another one.
    wanted = [tables[shape.name] for shape in empty]
    for shape in wanted:
        read[shape.name] = Sum()
        write_rows(connection, shape, _counted(rows(shape), read[shape.name]))
    for shape in wanted:
        if summed(connection, shape) != read[shape.name]:
            raise UnlikeError(f"The table {shape.name} does not hold what was read: nothing was changed.")
    if revision != head():
        bring(connection, head())
    return read


def _counted(rows: Iterator[Row], into: Sum) -> Iterator[Row]:
    for row in rows:
        into.add(line_of(row))
        yield row


def _count(connection: Connection, name: str) -> int:
    return connection.scalar(select(func.count()).select_from(sql_table(name))) or 0
