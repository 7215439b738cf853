"""What the UAVs were told, and when the places of a campaign's users were wiped."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    """Forward."""
    op.create_table(
        "setpoints",
        sa.Column("id", sa.Integer, primary_key=True, autoincrement=True),
        sa.Column("campaign_id", sa.String(64), nullable=False),
        sa.Column("slot", sa.Integer, nullable=False),
        sa.Column("document", sa.JSON, nullable=False),
        sa.Column("recorded_at", MOMENT, nullable=False),
    )
    op.create_index("ix_setpoints_campaign_id", "setpoints", ["campaign_id"])
    op.add_column("campaigns", sa.Column("places_wiped_at", MOMENT))


def downgrade() -> None:
    """Back."""
    op.drop_column("campaigns", "places_wiped_at")
    op.drop_table("setpoints")
