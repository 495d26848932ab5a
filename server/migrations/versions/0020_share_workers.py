"""Remember who launched what, whose turn it was last, and how many runs of an experiment may be under way."""

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("experiments", sa.Column("launched_by", sa.String(16), nullable=True))
    op.add_column("experiments", sa.Column("parallel_runs", sa.Integer(), nullable=True))
    op.add_column("studies", sa.Column("launched_by", sa.String(16), nullable=True))
    op.create_table(
        "shares",
        sa.Column("person", sa.String(16), primary_key=True),
        sa.Column("turn", sa.BigInteger(), nullable=False),
    )


def downgrade() -> None:
    op.drop_table("shares")
    op.drop_column("studies", "launched_by")
    op.drop_column("experiments", "parallel_runs")
    op.drop_column("experiments", "launched_by")
