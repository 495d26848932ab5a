"""Search settings by studies."""

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "studies",
        sa.Column("id", sa.String(length=16), primary_key=True),
        sa.Column("project_id", sa.String(length=16), sa.ForeignKey("projects.id"), nullable=False),
        sa.Column("name", sa.String(length=120), nullable=False),
        sa.Column("spec", sa.JSON(), nullable=False),
        sa.Column("state", sa.String(length=12), nullable=False),
        sa.Column("budget", sa.Integer(), nullable=False),
        sa.Column("asked", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.Float(), nullable=False),
        sa.Column("finished_at", sa.Float(), nullable=True),
        sa.Column("suite_hash", sa.String(length=64), nullable=True),
        sa.Column("importances", sa.JSON(), nullable=True),
        sa.Column("judged_trial", sa.Integer(), nullable=True),
        sa.Column("judgement_id", sa.String(length=16), nullable=True),
    )
    for column in ("project_id", "state", "created_at"):
        op.create_index(f"ix_studies_{column}", "studies", [column])
    op.create_table(
        "study_trials",
        sa.Column("study_id", sa.String(length=16), sa.ForeignKey("studies.id", ondelete="CASCADE"), primary_key=True),
        sa.Column("number", sa.Integer(), primary_key=True, autoincrement=False),
        sa.Column("experiment_id", sa.String(length=16), nullable=True),
        sa.Column("state", sa.String(length=12), nullable=False),
        sa.Column("values", sa.JSON(), nullable=False),
        sa.Column("rungs", sa.JSON(), nullable=False),
        sa.Column("success", sa.Float(), nullable=True),
        sa.Column("seconds_to_target", sa.Float(), nullable=True),
        sa.Column("score", sa.Float(), nullable=True),
        sa.Column("cost", sa.Float(), nullable=True),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("created_at", sa.Float(), nullable=False),
        sa.Column("finished_at", sa.Float(), nullable=True),
    )
    with op.batch_alter_table("experiments") as batch:
        batch.add_column(sa.Column("study_id", sa.String(length=16), nullable=True))
        batch.create_foreign_key("experiments_study_id_fkey", "studies", ["study_id"], ["id"], ondelete="SET NULL")
        batch.create_index("ix_experiments_study_id", ["study_id"])


def downgrade() -> None:
    with op.batch_alter_table("experiments") as batch:
        batch.drop_index("ix_experiments_study_id")
        batch.drop_constraint("experiments_study_id_fkey", type_="foreignkey")
        batch.drop_column("study_id")
    op.drop_table("study_trials")
    op.drop_table("studies")
