"""Keep jobs of workers beside runs, and the evaluations that people ask for."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

_OPEN = sa.text("state IN ('queued', 'running')")


def upgrade() -> None:
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(length=16), primary_key=True),
        sa.Column("kind", sa.String(length=12), nullable=False),
        sa.Column("key", sa.String(length=120), nullable=False),
        sa.Column("title", sa.String(length=200), nullable=False),
        sa.Column("spec", sa.JSON(), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=True),
        sa.Column("state", sa.String(length=12), nullable=False),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("worker", sa.String(length=120), nullable=True),
        sa.Column("claim_id", sa.String(length=32), nullable=True),
        sa.Column("losses", sa.Integer(), nullable=False),
        sa.Column("lost_by", sa.JSON(), nullable=True),
        sa.Column("error", sa.Text(), nullable=True),
        sa.Column("created_at", sa.Float(), nullable=False),
        sa.Column("started_at", sa.Float(), nullable=True),
        sa.Column("finished_at", sa.Float(), nullable=True),
    )
    op.create_index("jobs_by_state", "jobs", ["state", "priority", "created_at"])
    op.create_index("open_jobs_by_key", "jobs", ["key"], unique=True, sqlite_where=_OPEN, postgresql_where=_OPEN)
    op.create_table(
        "policy_evaluations",
        sa.Column("id", sa.String(length=16), primary_key=True),
        sa.Column("job_id", sa.String(length=16), nullable=False),
        sa.Column("key", sa.String(length=120), nullable=False),
        sa.Column("title", sa.String(length=200), nullable=False),
        sa.Column("policy", sa.JSON(), nullable=False),
        sa.Column("choice", sa.JSON(), nullable=False),
        sa.Column("checkpoint_id", sa.String(length=16), nullable=True),
        sa.Column("created_at", sa.Float(), nullable=False),
        sa.Column("error", sa.Text(), nullable=True),
        sa.Column("suite", sa.String(length=64), nullable=True),
        sa.Column("suite_hash", sa.String(length=64), nullable=True),
        sa.Column("figures", sa.JSON(), nullable=True),
        sa.Column("task", sa.JSON(), nullable=True),
        sa.Column("episodes", sa.LargeBinary(), nullable=True),
        sa.Column("ways", sa.LargeBinary(), nullable=True),
    )
    for column in ("job_id", "key", "checkpoint_id", "created_at", "suite_hash"):
        op.create_index(f"ix_policy_evaluations_{column}", "policy_evaluations", [column])


def downgrade() -> None:
    op.drop_table("policy_evaluations")
    op.drop_table("jobs")
