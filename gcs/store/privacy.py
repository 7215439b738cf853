"""Forgetting where people were: a campaign's results stay, its users' places, names and receipts go.

AoI, data and service of every user stay, under the number of his row, so that metrics can still be recomputed. What a
place could be read from goes: places in slots and in decisions, whom a drone attended to and where they were
expected, and receipts. The audit log holds none.
"""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Engine, delete, select, update
from sqlalchemy.orm import Session

from gcs.store.decision_documents import without_places
from gcs.store.models import CampaignRow, DecisionRow, SlotRow, UploadRow
from gcs.store.records import TERMINAL


def campaigns_to_wipe(engine: Engine, before: datetime) -> Sequence[str]:
    """Campaigns that are over since before this moment and still hold places."""
    over = CampaignRow.state.in_([state.value for state in TERMINAL])
    held = over & (CampaignRow.updated_at < before) & CampaignRow.places_wiped_at.is_(None)
    with Session(engine) as session:
        return list(session.scalars(select(CampaignRow.id).where(held).order_by(CampaignRow.created_at)))


def wipe_places(engine: Engine, campaign_id: str) -> None:
    """Irrevocably, in one transaction; what a database keeps of deleted pages goes too (SQLite)."""
    with Session(engine) as session, session.begin():
        for row in session.scalars(select(SlotRow).where(SlotRow.campaign_id == campaign_id)):
            row.users = [_nobody(number, user) for number, user in enumerate(row.users)]
        for decision in session.scalars(select(DecisionRow).where(DecisionRow.campaign_id == campaign_id)):
            decision.document = without_places(decision.document)
        session.execute(delete(UploadRow).where(UploadRow.campaign_id == campaign_id))
        changed = update(CampaignRow).where(CampaignRow.id == campaign_id)
        session.execute(changed.values(places_wiped_at=datetime.now(UTC)))
    if engine.dialect.name == "sqlite":
        with engine.connect() as connection:
            connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")


def _nobody(number: int, user: Mapping[str, Any]) -> dict[str, Any]:
    return {**user, "user_id": f"user {number}", "east_m": None, "north_m": None}
