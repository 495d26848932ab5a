"""Keep steps and wall times of points once for all series that were reported together."""

import zlib

import numpy as np
import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None

_LEVEL = 3
_CHUNKS_AT_ONCE = 64

_CHUNKS = sa.table(
    "metric_chunks",
    sa.column("run_id", sa.String),
    sa.column("name", sa.String),
    sa.column("first_step", sa.BigInteger),
    sa.column("points", sa.LargeBinary),
    sa.column("axis", sa.String),
)
_AXES = sa.table(
    "metric_axes", sa.column("run_id", sa.String), sa.column("id", sa.String), sa.column("data", sa.LargeBinary)
)


def upgrade() -> None:
    # Chunks that are there stay as they are, and are read on.
    op.create_table(
        "metric_axes",
        sa.Column("run_id", sa.String(length=16), nullable=False),
        sa.Column("id", sa.String(length=16), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["run_id"], ["runs.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("run_id", "id"),
    )
    op.add_column("metric_chunks", sa.Column("axis", sa.String(length=16), nullable=True))
    op.create_index("metric_chunks_by_axis", "metric_chunks", ["run_id", "axis"])


def downgrade() -> None:
    _write_axes_into_chunks(op.get_bind())
    op.drop_index("metric_chunks_by_axis", "metric_chunks")
    op.drop_column("metric_chunks", "axis")
    op.drop_table("metric_axes")


def _write_axes_into_chunks(connection: sa.Connection) -> None:
    key = (_CHUNKS.c.run_id, _CHUNKS.c.name, _CHUNKS.c.first_step)
    due = sa.select(*key, _CHUNKS.c.points, _AXES.c.data).join(
        _AXES, (_AXES.c.run_id == _CHUNKS.c.run_id) & (_AXES.c.id == _CHUNKS.c.axis)
    )
    while rows := connection.execute(due.limit(_CHUNKS_AT_ONCE)).all():
        for run_id, name, first_step, points, axis in rows:
            this = (_CHUNKS.c.run_id == run_id) & (_CHUNKS.c.name == name) & (_CHUNKS.c.first_step == first_step)
            connection.execute(sa.update(_CHUNKS).where(this).values(points=_whole(axis, points), axis=None))


def _whole(axis: bytes, values: bytes) -> bytes:
    """A chunk with its own steps and times, as it was before."""
    numbers = _joined(zlib.decompress(axis), 8).view("<i8").reshape(2, -1)
    bits = _joined(zlib.decompress(values[1:]), 4).view("<u4")
    if values[0] == 1:
        bits = np.cumsum((bits >> 1).astype(np.int32) ^ -(bits & 1).astype(np.int32), dtype=np.int32).view("<u4")
    planes = np.ascontiguousarray(bits.view(np.uint8).reshape(-1, 4).T)
    return zlib.compress(numbers[0].tobytes() + np.cumsum(numbers[1]).tobytes() + planes.tobytes(), _LEVEL)


def _joined(data: bytes, size: int) -> np.ndarray[tuple[int], np.dtype[np.uint8]]:
    """The bytes of numbers of `size` bytes each from their planes; of an axis, whose halves have planes of their own."""
    halves = (data[: len(data) // 2], data[len(data) // 2 :]) if size == 8 else (data,)
    parts = [np.frombuffer(half, np.uint8).reshape(size, -1).T.ravel() for half in halves]
    return np.concatenate(parts)
