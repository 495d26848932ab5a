"""Remember on which device a run began, and which workers are to take up no more."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("runs", sa.Column("device", sa.String(length=8), nullable=True))
    op.add_column("workers", sa.Column("drained_at", sa.Float(), nullable=True))


def downgrade() -> None:
    op.drop_column("workers", "drained_at")
    op.drop_column("runs", "device")
