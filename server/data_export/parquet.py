"""Tables as Parquet, made while they are sent: a row group at a time, with types, units and meanings in the schema.

What writes it (pyarrow) is a part of its own, `mapless[parquet]`, and is loaded where somebody asks for it.
"""

import importlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np

from server.data_export.columns import BUCKETS, POINTS, Column
from server.data_export.outbox import Outbox
from server.data_export.series import RunSeries, ThinnedMeanwhileError, stood_for
from server.errors import MissingExtraError

MEDIA_TYPE = "application/vnd.apache.parquet"
# Of a row group: a megabyte or two in memory.
_ROWS = 2**16
# As the readers of ten years know them.
_WRITTEN = {"compression": "zstd", "version": "2.6", "data_page_version": "1.0"}

Block = Mapping[str, Any]
"""Some rows: a value for all of them, or as many as there are rows, by column."""


def require_parquet() -> None:
    """Refuse before anything is sent.

    Raises:
        MissingExtraError: what writes Parquet is not installed.
    """
    if find_spec("pyarrow") is None:
        raise MissingExtraError("Parquet", "parquet", "or ask for CSV")


def parquet(columns: Sequence[Column], blocks: Iterable[tuple[int, Block]], about: Mapping[str, str]) -> Iterator[bytes]:
    """A Parquet file, block by block.

    Args:
        columns: of the table.
        blocks: how many rows, and what is in them; those of one row group are held at a time.
        about: what the schema says of the table.
    """
    arrow, files = importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")
    schema = arrow.schema([_field(arrow, column) for column in columns], metadata=dict(about))
    outbox = Outbox()
    with files.ParquetWriter(outbox, schema, **_WRITTEN) as writer:
        for rows in _grouped(blocks):
            arrays = [
                arrow.chunked_array([_array(arrow, column, count, block[column.name]) for count, block in rows])
                for column in columns
            ]
            writer.write_table(arrow.Table.from_arrays([array.unify_dictionaries() for array in arrays], schema=schema))
            yield outbox.taken()
    yield outbox.taken()


def point_blocks(run_id: str, seed: int, series: RunSeries, *, wide: bool) -> Iterator[tuple[int, Block]]:
    """A run's points, as `server.data_export.table.point_rows` has them.

    Args:
        run_id: of the run.
        seed: of the run.
        series: its points.
        wide: with the columns of thinned curves.

    Raises:
        ThinnedMeanwhileError: it was thinned, which the schema does not say.
    """
    if series.thinned and not wide:
        raise ThinnedMeanwhileError
    for name, points in series.pieces:
        block = {"run": run_id, "seed": seed, "metric": name, "step": points.steps, "wall_time": points.times}
        block["value"] = points.values
        if wide:
            each = stood_for(points, series.thinned.get(name))
            block |= {"points": each.sizes, "min": each.low, "max": each.high}
        yield len(points), block


def point_columns(*, wide: bool) -> tuple[Column, ...]:
    """Of a file of points; `wide` where curves in it were thinned."""
    return (*POINTS, *BUCKETS) if wide else POINTS


def row_blocks(columns: Sequence[Column], rows: Iterable[Sequence[object]]) -> Iterator[tuple[int, Block]]:
    """Rows that come one by one."""
    held: list[Sequence[object]] = []
    for row in rows:
        held.append(row)
        if len(held) == _ROWS:
            yield _block(columns, held)
            held = []
    yield _block(columns, held)


def _block(columns: Sequence[Column], rows: Sequence[Sequence[object]]) -> tuple[int, Block]:
    return len(rows), {column.name: [row[place] for row in rows] for place, column in enumerate(columns)}


def _grouped(blocks: Iterable[tuple[int, Block]]) -> Iterator[list[tuple[int, Block]]]:
    """Blocks that make a row group together; at least one group, so that an empty table is one."""
    group: list[tuple[int, Block]] = []
    rows = 0
    for count, block in blocks:
        if rows and rows + count > _ROWS:
            yield group
            group, rows = [], 0
        group.append((count, block))
        rows += count
    if group:
        yield group


def _field(arrow: Any, column: Column) -> Any:
    types = {
        "text": arrow.dictionary(arrow.int32(), arrow.string()),
        "integer": arrow.int64(),
        "number": arrow.float64(),
        "single": arrow.float32(),
        "flag": arrow.bool_(),
    }
    told = {"description": column.meaning} | ({} if column.unit is None else {"unit": column.unit})
    return arrow.field(column.name, types[column.kind], metadata=told)


def _array(arrow: Any, column: Column, count: int, cells: Any) -> Any:
    if column.kind == "text":
        if not isinstance(cells, list):
            return arrow.DictionaryArray.from_arrays(np.zeros(count, np.int32), arrow.array([cells], arrow.string()))
        return arrow.array(cells, arrow.string()).dictionary_encode()
    plain = _field(arrow, column).type
    if isinstance(cells, int):
        return arrow.array(np.full(count, cells, np.int64))
    if isinstance(cells, np.ndarray) and column.kind in ("single", "number"):
        return arrow.array(cells.astype(np.float32 if column.kind == "single" else np.float64), from_pandas=True)
    return arrow.array(cells, plain)


def about(kind: str, **told: object) -> dict[str, str]:
    """What the schema says of a table: what it is, and of what."""
    return {"mapless": json.dumps({"table": kind, **told})}
