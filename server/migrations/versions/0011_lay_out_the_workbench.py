"""Settings to filter by, last evaluations beside their runs, tags, notes, stars, archive, trash, and named views."""

from typing import Any

import sqlalchemy as sa
from alembic import op
from sqlalchemy.types import TypeEngine

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

_EXPERIMENT_COLUMNS: tuple[tuple[str, TypeEngine[Any]], ...] = (
    ("notes", sa.Text()),
    ("starred_at", sa.Float()),
    ("archived_at", sa.Float()),
    ("deleted_at", sa.Float()),
    ("indexed_as", sa.String(length=12)),
)
_RUN_COLUMNS: tuple[tuple[str, TypeEngine[Any]], ...] = (
    ("final_step", sa.BigInteger()),
    ("final_suite", sa.String(length=64)),
    ("final_arrivals", sa.Integer()),
    ("final_episodes", sa.Integer()),
)
_LAST_EVALUATIONS = sa.text(
    """
    SELECT c.run_id AS run_id, c.step AS step, e.suite_hash AS suite, e.arrivals AS arrivals, e.episode_count AS episodes
    FROM checkpoints c
    JOIN evaluations e ON e.checkpoint_id = c.id
    JOIN (
        SELECT i.run_id AS run_id, max(i.step) AS step
        FROM checkpoints i JOIN evaluations j ON j.checkpoint_id = i.id GROUP BY i.run_id
    ) last ON last.run_id = c.run_id AND last.step = c.step
    ORDER BY e.created_at
    """
)
_KEEP = sa.text(
    "UPDATE runs SET final_step = :step, final_suite = :suite, final_arrivals = :arrivals, final_episodes = :episodes "
    "WHERE id = :run_id"
)


def upgrade() -> None:
    for name, kind in _EXPERIMENT_COLUMNS:
        op.add_column("experiments", sa.Column(name, kind, nullable=True))
    op.create_index("ix_experiments_deleted_at", "experiments", ["deleted_at"])
    op.create_index("ix_experiments_indexed_as", "experiments", ["indexed_as"])
    for name, kind in _RUN_COLUMNS:
        op.add_column("runs", sa.Column(name, kind, nullable=True))
    # Filled by the service, which knows what settings mean.
    op.create_table(
        "experiment_keys",
        sa.Column("experiment_id", sa.String(length=16), nullable=False),
        sa.Column("key", sa.String(length=160), nullable=False),
        sa.Column("number", sa.Float(), nullable=True),
        sa.Column("text", sa.String(length=200), nullable=True),
        sa.ForeignKeyConstraint(["experiment_id"], ["experiments.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("experiment_id", "key"),
    )
    op.create_index("experiment_keys_by_key", "experiment_keys", ["key"])
    op.create_table(
        "experiment_tags",
        sa.Column("experiment_id", sa.String(length=16), nullable=False),
        sa.Column("tag", sa.String(length=40), nullable=False),
        sa.ForeignKeyConstraint(["experiment_id"], ["experiments.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("experiment_id", "tag"),
    )
    op.create_index("ix_experiment_tags_tag", "experiment_tags", ["tag"])
    op.create_table(
        "saved_views",
        sa.Column("id", sa.String(length=16), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("address", sa.Text(), nullable=False),
        sa.Column("created_at", sa.Float(), nullable=False),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("name"),
    )
    _keep_last_evaluations(op.get_bind())


def _keep_last_evaluations(connection: sa.Connection) -> None:
    # Of two of the same step the newer one.
    last = {row["run_id"]: dict(row) for row in connection.execute(_LAST_EVALUATIONS).mappings()}
    if last:
        connection.execute(_KEEP, list(last.values()))


def downgrade() -> None:
    op.drop_table("saved_views")
    op.drop_table("experiment_tags")
    op.drop_table("experiment_keys")
    for name, _ in reversed(_RUN_COLUMNS):
        op.drop_column("runs", name)
    op.drop_index("ix_experiments_indexed_as", "experiments")
    op.drop_index("ix_experiments_deleted_at", "experiments")
    for name, _ in reversed(_EXPERIMENT_COLUMNS):
        op.drop_column("experiments", name)
