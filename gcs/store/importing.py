"""A recorded campaign put into a store that it was not flown with, for looking at it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import Engine
from sqlalchemy.orm import Session

from gcs.ports import CampaignState, Event, SlotRecord, TelemetrySample
from gcs.store.decision_documents import recorded_decision
from gcs.store.entries import SlotEntry, TelemetryEntry, Writer, apply
from gcs.store.jsonable import clean_text, jsonable
from gcs.store.models import CampaignRow, DecisionRow


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
    decisions: tuple[Mapping[str, Any], ...] = ()  # as gcs.store.decision_documents writes them


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
        for document in campaign.decisions:
            session.add(_decision_row(campaign, document, moment))
        for event in campaign.events:
            Writer(session, moment(event.time_s)).write(event)
            session.flush()  # the next one hangs on to it
        session.refresh(row)
        row.state, row.reason = campaign.state.value, clean_text(campaign.reason)  # whatever the last event said


def _decision_row(
    campaign: ForeignCampaign, document: Mapping[str, Any], moment: Callable[[float], datetime]
) -> DecisionRow:
    """As it was written: its reasons are those of then. Raises KeyError, TypeError, ValueError for what is none."""
    record = recorded_decision(document)
    slot_s = next((one.time_s for one in campaign.records if one.slot == record.slot), 0.0)
    made_at = moment(record.time_s if math.isfinite(record.time_s) else slot_s)
    return DecisionRow(campaign_id=campaign.id, slot=record.slot, document=jsonable(document), recorded_at=made_at)


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
