"""Checkpoints of campaigns in the air, decisions with their inputs, the audit log as a chain, answers kept by key."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    """Forward."""
    op.create_table(
        "checkpoints",
        sa.Column("campaign_id", sa.String(64), primary_key=True),
        sa.Column("document", sa.JSON, nullable=False),
        sa.Column("taken_at", MOMENT, nullable=False),
    )
    op.create_table(
        "decisions",
        sa.Column("id", sa.Integer, primary_key=True, autoincrement=True),
        sa.Column("campaign_id", sa.String(64), nullable=False),
        sa.Column("slot", sa.Integer, nullable=False),
        sa.Column("document", sa.JSON, nullable=False),
        sa.Column("recorded_at", MOMENT, nullable=False),
    )
    op.create_index("ix_decisions_campaign_id", "decisions", ["campaign_id"])
    op.create_table(
        "answers",
        sa.Column("actor", sa.String(128), primary_key=True),
        sa.Column("key", sa.String(128), primary_key=True),
        sa.Column("request", sa.String(64), nullable=False),
        sa.Column("status", sa.Integer),
        sa.Column("body", sa.Text),
        sa.Column("created_at", MOMENT, nullable=False),
    )
    op.create_index("ix_answers_created_at", "answers", ["created_at"])
    op.add_column("events", sa.Column("digest", sa.String(64)))


def downgrade() -> None:
    """Back."""
    op.drop_column("events", "digest")
    for table in ("answers", "decisions", "checkpoints"):
        op.drop_table(table)
