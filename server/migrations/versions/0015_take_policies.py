"""Take policies from elsewhere, to be measured."""

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "uploaded_policies",
        sa.Column("id", sa.String(length=16), primary_key=True),
        sa.Column("project_id", sa.String(length=16), sa.ForeignKey("projects.id"), nullable=False),
        sa.Column("name", sa.String(length=120), nullable=False),
        sa.Column("task", sa.JSON(), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.Float(), nullable=False),
        sa.Column("graph", sa.LargeBinary(), nullable=False),
    )
    op.create_index("ix_uploaded_policies_project_id", "uploaded_policies", ["project_id"])
    op.create_index("ix_uploaded_policies_created_at", "uploaded_policies", ["created_at"])
    op.add_column("policy_evaluations", sa.Column("upload_id", sa.String(length=16), nullable=True))
    op.create_index("ix_policy_evaluations_upload_id", "policy_evaluations", ["upload_id"])


def downgrade() -> None:
    op.drop_index("ix_policy_evaluations_upload_id", "policy_evaluations")
    op.drop_column("policy_evaluations", "upload_id")
    op.drop_table("uploaded_policies")
