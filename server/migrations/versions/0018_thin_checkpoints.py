"""Remember which checkpoints go, and by which rule."""

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("checkpoints", sa.Column("goes_at", sa.Float(), nullable=True))
    op.create_index("ix_checkpoints_goes_at", "checkpoints", ["goes_at"])
    op.add_column("experiments", sa.Column("keep_rule", sa.JSON(), nullable=True))


def downgrade() -> None:
    op.drop_column("experiments", "keep_rule")
    op.drop_index("ix_checkpoints_goes_at", "checkpoints")
    op.drop_column("checkpoints", "goes_at")
