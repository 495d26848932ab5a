"""Remember archives that no checkpoint names, and drop evaluations of nothing, which earlier versions took."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "loose_archives",
        sa.Column("id", sa.String(length=16), nullable=False),
        sa.Column("since", sa.Float(), nullable=False),
        sa.Column("doomed", sa.Boolean(), nullable=False),
        sa.PrimaryKeyConstraint("id"),
    )
    op.execute("DELETE FROM evaluations WHERE episode_count = 0")


def downgrade() -> None:
    op.drop_table("loose_archives")
