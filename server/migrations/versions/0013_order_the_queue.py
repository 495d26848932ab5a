"""Order the queue by priority; remember what workers' machines are like, and how busy they were."""

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("runs", sa.Column("priority", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("workers", sa.Column("machine", sa.JSON(), nullable=True))
    op.add_column("workers", sa.Column("activity", sa.JSON(), nullable=True))
    op.add_column("workers", sa.Column("last_run_id", sa.String(16), nullable=True))


def downgrade() -> None:
    op.drop_column("workers", "last_run_id")
    op.drop_column("workers", "activity")
    op.drop_column("workers", "machine")
    op.drop_column("runs", "priority")
