"""Group experiments into projects; those that are there belong to the first one."""

import time

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    projects = op.create_table(
        "projects",
        sa.Column("id", sa.String(length=16), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("created_at", sa.Float(), nullable=False),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("name"),
    )
    op.bulk_insert(projects, [{"id": "default", "name": "Default", "created_at": time.time()}])
    op.add_column("experiments", sa.Column("project_id", sa.String(length=16), nullable=True))
    op.execute("UPDATE experiments SET project_id = 'default'")
    with op.batch_alter_table("experiments") as experiments:
        experiments.alter_column("project_id", existing_type=sa.String(length=16), nullable=False)
        experiments.create_foreign_key("experiments_project_id_fkey", "projects", ["project_id"], ["id"])
    op.create_index("ix_experiments_project_id", "experiments", ["project_id"])


def downgrade() -> None:
    op.drop_index("ix_experiments_project_id", "experiments")
    with op.batch_alter_table("experiments") as experiments:
        experiments.drop_constraint("experiments_project_id_fkey", type_="foreignkey")
        experiments.drop_column("project_id")
    op.drop_table("projects")
