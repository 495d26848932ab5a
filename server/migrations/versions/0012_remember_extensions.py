"""Remember which extensions each worker has."""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("workers", sa.Column("extensions", sa.JSON(), nullable=True))


def downgrade() -> None:
    op.drop_column("workers", "extensions")
