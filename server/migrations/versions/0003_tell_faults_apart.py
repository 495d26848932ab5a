"""Tell a run's faults from its worker's: who lost it, by which claim, from which checkpoint, and what ails a worker."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("runs", schema=None) as batch_op:
        batch_op.add_column(sa.Column("claim_id", sa.String(length=32), nullable=True))
        batch_op.add_column(sa.Column("lost_by", sa.JSON(), nullable=True))
    with op.batch_alter_table("checkpoints", schema=None) as batch_op:
        batch_op.add_column(sa.Column("damaged_at", sa.Float(), nullable=True))
    with op.batch_alter_table("workers", schema=None) as batch_op:
        batch_op.add_column(sa.Column("trouble", sa.Text(), nullable=True))


def downgrade() -> None:
    # Not in a batch: that would build runs and checkpoints anew, and what hangs on them would be gone with the old tables.
    op.drop_column("workers", "trouble")
    op.drop_column("checkpoints", "damaged_at")
    op.drop_column("runs", "lost_by")
    op.drop_column("runs", "claim_id")
