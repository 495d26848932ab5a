"""Keep what an experiment's checkpoints take beside it."""

import sqlalchemy as sa
from alembic import op

revision = "0022"
down_revision = "0020"
branch_labels = None
depends_on = None

_COLUMNS = {
    "checkpoint_count": sa.Integer(),
    "checkpoint_bytes": sa.BigInteger(),
    "going_count": sa.Integer(),
    "going_bytes": sa.BigInteger(),
}
_ADD_UP = """
UPDATE experiments SET
  checkpoint_count = (
    SELECT COUNT(*) FROM checkpoints c JOIN runs r ON r.id = c.run_id WHERE r.experiment_id = experiments.id
  ),
  checkpoint_bytes = (
    SELECT COALESCE(SUM(c.size), 0) FROM checkpoints c JOIN runs r ON r.id = c.run_id WHERE r.experiment_id = experiments.id
  ),
  going_count = (
    SELECT COUNT(c.goes_at) FROM checkpoints c JOIN runs r ON r.id = c.run_id WHERE r.experiment_id = experiments.id
  ),
  going_bytes = (
    SELECT COALESCE(SUM(CASE WHEN c.goes_at IS NULL THEN 0 ELSE c.size END), 0)
    FROM checkpoints c JOIN runs r ON r.id = c.run_id WHERE r.experiment_id = experiments.id
  )
"""


def upgrade() -> None:
    for name, kind in _COLUMNS.items():
        op.add_column("experiments", sa.Column(name, kind, nullable=False, server_default="0"))
    op.execute(_ADD_UP)


def downgrade() -> None:
    for name in reversed(_COLUMNS):
        op.drop_column("experiments", name)
