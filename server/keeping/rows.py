"""Rows of tables exactly as a database holds them, whichever it is: read, written, and summed up to be compared.

Tables are taken as they are found, not as this version's models have them: those of an older version are as good.
"""

import base64
import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Connection,
    Float,
    Integer,
    LargeBinary,
    MetaData,
    Text,
    bindparam,
    cast,
    func,
    select,
    text,
)
from sqlalchemy import column as sql_column
from sqlalchemy import table as sql_table
from sqlalchemy.exc import DBAPIError
from sqlalchemy.sql.expression import TableClause
from sqlalchemy.types import TypeEngine

from server.errors import ServiceError

Kind = Literal["integer", "float", "text", "boolean", "bytes", "json"]
"""What a column holds; `json` is kept as the text that the database has of it."""

Value = int | float | str | bool | bytes | None
Row = tuple[Value, ...]

_TYPES: dict[Kind, TypeEngine[Any]] = {
    "integer": BigInteger(),
    "float": Float(53),
    "text": Text(),
    "boolean": Boolean(),
    "bytes": LargeBinary(),
    "json": Text(),
}
_ALEMBICS = "alembic_version"
# A robot's recording has up to 32 MiB.
_READ_AT_ONCE = 8
_WRITE_AT_ONCE = 500
_WRITE_BYTES = 4 * 2**20
_MODULUS = 2**256


class UnfitRowsError(ServiceError):
    """A table can't be read or written as it is."""


@dataclass(frozen=True)
class Shape:
    """A table: its name, and what each of its columns holds."""

    name: str
    columns: dict[str, Kind]


@dataclass
class Sum:
    """How many rows a table has, and the sum of their SHA-256: the same in whichever order they come."""

    rows: int = 0
    total: int = field(default=0, repr=False)

    def add(self, line: bytes) -> None:
        """One more row, as a `line`."""
        self.rows += 1
        self.total = (self.total + int.from_bytes(hashlib.sha256(line).digest())) % _MODULUS

    @property
    def digest(self) -> str:
        """64 hexadecimal digits."""
        return f"{self.total:064x}"


def shapes(connection: Connection) -> list[Shape]:
    """Every table but Alembic's, those that others hang on first.

    Raises:
        UnfitRowsError: a column is of a kind that no table of ours has.
    """
    metadata = MetaData()
    metadata.reflect(connection)
    return [
        Shape(table.name, {column.name: _kind(table.name, column.name, column.type) for column in table.columns})
        for table in metadata.sorted_tables
        if table.name != _ALEMBICS
    ]


def read_rows(connection: Connection, shape: Shape) -> Iterator[Row]:
    """All rows of a table, some at a time."""
    source = _table(shape)
    # PostgreSQL's driver would parse JSON; its text is what another database is to have.
    columns = [cast(source.c[name], Text) if kind == "json" else source.c[name] for name, kind in shape.columns.items()]
    for row in connection.execute(select(*columns), execution_options={"yield_per": _READ_AT_ONCE}):
        yield tuple(row)


def write_rows(connection: Connection, shape: Shape, rows: Iterable[Row]) -> None:
    """Add rows to a table, some at a time; numbers that it gives to rows go on after theirs.

    Raises:
        UnfitRowsError: the database refuses one: PostgreSQL takes no text longer than its column, and no zero characters.
    """
    try:
        for batch in _batches(rows):
            connection.execute(_insertion(connection, shape), [_named(shape, row) for row in batch])
    except DBAPIError as error:
        reason = str(error.orig).strip().splitlines()[0]
        raise UnfitRowsError(f"The table {shape.name} can't be written: {reason}") from error
    _go_on_counting(connection, shape)


def summed(connection: Connection, shape: Shape) -> Sum:
    """What a table holds."""
    found = Sum()
    for row in read_rows(connection, shape):
        found.add(line_of(row))
    return found


def line_of(row: Row) -> bytes:
    """A row as a line of JSON: numbers to the last bit, bytes in base64."""
    values = [base64.b64encode(value).decode() if isinstance(value, bytes) else value for value in row]
    return json.dumps(values, ensure_ascii=False, separators=(",", ":")).encode("utf-8", "surrogatepass") + b"\n"


def row_of(line: bytes, shape: Shape) -> Row:
    """The row that `line_of` made a line of.

    Raises:
        UnfitRowsError: it is no row of this table.
    """
    try:
        values = json.loads(line)
        return tuple(
            base64.b64decode(value) if kind == "bytes" and value is not None else value
            for value, kind in zip(values, shape.columns.values(), strict=True)
        )
    except (ValueError, TypeError) as error:
        raise UnfitRowsError(f"A row of the table {shape.name} is not whole.") from error


def _kind(table: str, column: str, found: TypeEngine[Any]) -> Kind:
    kinds: tuple[tuple[type[TypeEngine[Any]], Kind], ...] = (
        (JSON, "json"),
        (Boolean, "boolean"),
        (LargeBinary, "bytes"),
        (Integer, "integer"),
        (Float, "float"),
    )
    for kind, name in kinds:
        if isinstance(found, kind):
            return name
    if found.python_type is str:
        return "text"
    raise UnfitRowsError(f"{table}.{column} is of the kind {found}, which no table of Mapless has.")


def _table(shape: Shape) -> TableClause:
    return sql_table(shape.name, *(sql_column(name, _TYPES[kind]) for name, kind in shape.columns.items()))


def _insertion(connection: Connection, shape: Shape) -> Any:
    given = {
        name: cast(bindparam(f"p_{index}", type_=Text()), JSON)
        # To SQLite JSON is text, and a cast would make a number of it.
        if kind == "json" and connection.dialect.name == "postgresql"
        else bindparam(f"p_{index}", type_=_TYPES[kind])
        for index, (name, kind) in enumerate(shape.columns.items())
    }
    return _table(shape).insert().values(given)


def _named(shape: Shape, row: Row) -> dict[str, Value]:
    return {f"p_{index}": value for index, (_, value) in enumerate(zip(shape.columns, row, strict=True))}


def _batches(rows: Iterable[Row]) -> Iterator[list[Row]]:
    batch: list[Row] = []
    size = 0
    for row in rows:
        batch.append(row)
        size += sum(len(value) for value in row if isinstance(value, str | bytes))
        if len(batch) >= _WRITE_AT_ONCE or size >= _WRITE_BYTES:
            yield batch
            batch, size = [], 0
    if batch:
        yield batch


def _go_on_counting(connection: Connection, shape: Shape) -> None:
    """PostgreSQL takes the next number from a sequence, which knows nothing of rows that bring theirs."""
    if connection.dialect.name != "postgresql":
        return
    for name in (name for name, kind in shape.columns.items() if kind == "integer"):
        asked = text("SELECT pg_get_serial_sequence(:table, :column)")
        sequence = connection.scalar(asked, {"table": shape.name, "column": name})
        if sequence is not None:
            highest = connection.scalar(select(func.max(_table(shape).c[name])))
            if highest is not None:
                connection.execute(select(func.setval(sequence, highest)))
