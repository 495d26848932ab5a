"""Thin curves of runs that ended long ago, where somebody says so."""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.types import TypeEngine

revision = "0024"
down_revision = "0023"
branch_labels = None
depends_on = None

_COLUMNS: dict[str, TypeEngine[float] | TypeEngine[int]] = {
    "thins_at": sa.Float(),
    "thin_enough": sa.Integer(),
    "thinned_at": sa.Float(),
    "thinned_from": sa.BigInteger(),
    "thinned_to": sa.BigInteger(),
}


def upgrade() -> None:
    op.create_table(
        "thinned_series",
        sa.Column("run_id", sa.String(16), sa.ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True),
        sa.Column("name", sa.String(64), primary_key=True),
        sa.Column("points", sa.BigInteger(), nullable=False),
        sa.Column("buckets", sa.Integer(), nullable=False),
        sa.Column("last_step", sa.BigInteger(), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
    )
    op.add_column("experiments", sa.Column("curve_rule", sa.JSON()))
    for name, kind in _COLUMNS.items():
        op.add_column("runs", sa.Column(name, kind))
    op.create_index("runs_by_thinning", "runs", ["thins_at"])


def downgrade() -> None:
    op.drop_index("runs_by_thinning", "runs")
    for name in reversed(_COLUMNS):
        op.drop_column("runs", name)
    op.drop_column("experiments", "curve_rule")
    op.drop_table("thinned_series")
