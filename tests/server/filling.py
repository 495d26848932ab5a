"""Rows in every table, whichever version's they are, and a look at all of them."""

from typing import Any

from sqlalchemy import JSON, Column, Integer, MetaData, func, select

from server.database.engine import Database


def fill(database: Database) -> None:
    """Two rows in every table that has fewer, each hanging on the row of the same number in the tables above it."""
    metadata = MetaData()
    with database.engine.begin() as connection:
        metadata.reflect(connection)
        for table in metadata.sorted_tables:
            if table.name == "alembic_version" or (connection.scalar(select(func.count()).select_from(table)) or 0) > 1:
                continue
            for number in (1, 2):
                given = {column.name: some_value(column, number) for column in table.columns if not is_counted(column)}
                connection.execute(table.insert().values(given))


def is_counted(column: Column[Any]) -> bool:
    """Whether the database numbers the rows itself, from 1."""
    (first, *others) = column.table.primary_key
    return column is first and not others and isinstance(column.type, Integer)


def some_value(column: Column[Any], number: int) -> object:
    if column.foreign_keys:
        (key,) = column.foreign_keys
        column = key.column
    if isinstance(column.type, JSON):
        return {}
    kind = column.type.python_type
    if kind is str:
        return f"{number}{column.table.name.replace('_', '')}"[: getattr(column.type, "length", None) or 1_000]
    return {int: number, float: number / 4, bool: True, bytes: bytes([number])}[kind]


def rows(database: Database) -> dict[str, list[dict[str, Any]]]:
    """All rows of all tables, by the table's name, in the order of their first column."""
    metadata = MetaData()
    with database.engine.begin() as connection:
        metadata.reflect(connection)
        return {
            table.name: [dict(row) for row in connection.execute(table.select().order_by(*table.primary_key)).mappings()]
            for table in metadata.sorted_tables
            if table.name != "alembic_version"
        }
