"""Mark the experiments of a campaign."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("experiments", schema=None) as batch_op:
        batch_op.add_column(sa.Column("campaign", sa.String(length=16), nullable=True))
        batch_op.add_column(sa.Column("campaign_row", sa.String(length=64), nullable=True))
        batch_op.create_index(batch_op.f("ix_experiments_campaign"), ["campaign"], unique=False)


def downgrade() -> None:
    with op.batch_alter_table("experiments", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_experiments_campaign"))
        batch_op.drop_column("campaign_row")
        batch_op.drop_column("campaign")
