"""How sure the importances of a study's settings are."""

import sqlalchemy as sa
from alembic import op

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("studies", sa.Column("importance_intervals", sa.JSON()))


def downgrade() -> None:
    op.drop_column("studies", "importance_intervals")
