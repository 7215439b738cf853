"""A recorded campaign put into a store that it was not flown with, for looking at it."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import Engine
from sqlalchemy.orm import Session

from gcs.ports import CampaignState, Event, SlotRecord, TelemetrySample
from gcs.store.entries import SlotEntry, TelemetryEntry, Writer, apply
from gcs.store.jsonable import clean_text, jsonable
from gcs.store.models import CampaignRow


@dataclass(frozen=True)
class ForeignCampaign:
    """What was exported of a campaign. Times of records and events are seconds of its flight clock."""

    id: str
    name: str
    policy: str
    user_source: str
    state: CampaignState
    reason: str
    document: Mapping[str, Any]
    slots: int
    slot_s: float
    begun_at: datetime
    records: tuple[SlotRecord, ...]
    events: tuple[Event, ...]
    telemetry: tuple[TelemetrySample, ...] = ()


def import_campaign(engine: Engine, campaign: ForeignCampaign) -> None:
    """Write all of it in one transaction; recorded when the flight clock says, counted from ``begun_at``."""

    def moment(time_s: float) -> datetime:
        return campaign.begun_at + timedelta(seconds=time_s)

    with Session(engine) as session, session.begin():
        row = _row(campaign)
        session.add(row)
        for record in campaign.records:
            apply(session, SlotEntry(campaign.id, record), moment(record.time_s))
        for sample in campaign.telemetry:
            apply(session, TelemetryEntry(campaign.id, sample), moment(sample.time_s))
        for event in campaign.events:
            Writer(session, moment(event.time_s)).write(event)
            session.flush()  # the next one hangs on to it
        session.refresh(row)
        row.state, row.reason = campaign.state.value, clean_text(campaign.reason)  # whatever the last event said


def _row(campaign: ForeignCampaign) -> CampaignRow:
    return CampaignRow(
        id=campaign.id,
        name=clean_text(campaign.name),
        policy=clean_text(campaign.policy),
        user_source=campaign.user_source,
        state=campaign.state.value,
        reason=clean_text(campaign.reason),
        document=jsonable(dict(campaign.document)),
        directory=None,
        slots=campaign.slots,
        slot_s=campaign.slot_s,
        created_by="imported",
        created_at=campaign.begun_at,
        updated_at=campaign.begun_at,
    )
