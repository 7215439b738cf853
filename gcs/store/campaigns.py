"""Campaigns: created, listed, their state set where no flight does it."""

import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from sqlalchemy import Engine, select, update
from sqlalchemy.orm import Session

from gcs.ports import CampaignState
from gcs.store.jsonable import clean_text, jsonable
from gcs.store.models import CampaignRow
from gcs.store.records import TERMINAL, CampaignRecord, campaign_record
from policy.mission_file import Mission


def new_campaign_id() -> str:
    """64 random bits: not to be guessed, and unique without asking the store."""
    return secrets.token_hex(8)


@dataclass(frozen=True)
class Campaigns:
    """The table of campaigns."""

    engine: Engine

    def create(self, mission: Mission, created_by: str, *, campaign_id: str | None = None) -> CampaignRecord:
        """A campaign of a checked mission is ready to be flown."""
        row = _new_row(mission, created_by, campaign_id or new_campaign_id(), datetime.now(UTC))
        with Session(self.engine, expire_on_commit=False) as session, session.begin():
            session.add(row)
        return campaign_record(row)

    def get(self, campaign_id: str) -> CampaignRecord | None:
        """One campaign, or None."""
        with Session(self.engine) as session:
            row = session.get(CampaignRow, campaign_id)
            return None if row is None else campaign_record(row)

    def newest(self, limit: int = 100, offset: int = 0) -> Sequence[CampaignRecord]:
        """Newest first."""
        order = (CampaignRow.created_at.desc(), CampaignRow.id)
        with Session(self.engine) as session:
            rows = session.scalars(select(CampaignRow).order_by(*order).limit(limit).offset(offset))
            return [campaign_record(row) for row in rows]

    def unfinished(self) -> Sequence[CampaignRecord]:
        """Campaigns that were being flown when the server last stopped, for who resumes them."""
        resting = {state.value for state in TERMINAL} | {CampaignState.DRAFT.value, CampaignState.READY.value}
        with Session(self.engine) as session:
            rows = session.scalars(select(CampaignRow).where(CampaignRow.state.not_in(resting)))
            return [campaign_record(row) for row in rows]

    def set_state(self, campaign_id: str, before: CampaignState, after: CampaignState, reason: str) -> bool:
        """Only from ``before``; False when somebody else was faster."""
        found = (CampaignRow.id == campaign_id) & (CampaignRow.state == before.value)
        changed = (
            update(CampaignRow).where(found).values(state=after.value, reason=reason, updated_at=datetime.now(UTC))
        )
        with Session(self.engine) as session, session.begin():
            result = session.execute(changed.returning(CampaignRow.id))
            return result.first() is not None


def _new_row(mission: Mission, created_by: str, campaign_id: str, now: datetime) -> CampaignRow:
    return CampaignRow(
        id=campaign_id,
        name=clean_text(mission.name),
        policy=clean_text(mission.policy),
        user_source=mission.users.kind,
        state=CampaignState.READY.value,
        reason="",
        document=jsonable(mission.document),
        directory=None if mission.directory is None else str(mission.directory),
        slots=mission.scenario.slots,
        slot_s=mission.scenario.slot_s,
        created_by=clean_text(created_by),
        created_at=now,
        updated_at=now,
    )
