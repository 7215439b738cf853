"""What the journal's queue holds, and the rows that each becomes."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import update
from sqlalchemy.orm import Session

from gcs.ports import (
    CampaignState,
    Checkpoint,
    DecisionRecord,
    Event,
    SetpointSummary,
    SlotRecord,
    TelemetrySample,
    Verdict,
)
from gcs.store.chain import digest_of, newest_digest
from gcs.store.decision_documents import decision_document
from gcs.store.jsonable import clean_text, jsonable
from gcs.store.models import (
    CampaignRow,
    CheckpointRow,
    CommandRow,
    DecisionRow,
    EventRow,
    SetpointsRow,
    SlotRow,
    TelemetryRow,
    UploadRow,
)
from gcs.store.vehicle_rows import vehicle_rows

STATES = frozenset(state.value for state in CampaignState)
STATE_KIND = "campaign.state"  # an event of this kind carries the new state in data["state"]


@dataclass(frozen=True)
class SlotEntry:
    """A slot of a campaign."""

    campaign_id: str
    record: SlotRecord


@dataclass(frozen=True)
class CommandEntry:
    """An operator's order with the vehicle's verdict."""

    actor: str
    verdict: Verdict


@dataclass(frozen=True)
class UploadEntry:
    """A receipt of a user's successful upload."""

    campaign_id: str
    user_id: str
    uploaded_at: datetime
    uploaded_mb: float | None


@dataclass(frozen=True)
class CheckpointEntry:
    """What a restarted server takes a campaign up from; ``taken_at`` on the wall clock."""

    checkpoint: Checkpoint
    taken_at: datetime


@dataclass(frozen=True)
class DecisionEntry:
    """What the policy was asked, and what it answered."""

    campaign_id: str
    record: DecisionRecord


@dataclass(frozen=True)
class SetpointsEntry:
    """What the UAVs were told on the way to the slot record of this number."""

    campaign_id: str
    slot: int
    told: tuple[SetpointSummary, ...]


@dataclass(frozen=True)
class TelemetryEntry:
    """What all vehicles said at one moment of a campaign."""

    campaign_id: str
    sample: TelemetrySample


Entry = (
    Event | SlotEntry | CommandEntry | UploadEntry | CheckpointEntry | DecisionEntry | SetpointsEntry | TelemetryEntry
)


class Writer:
    """Puts entries into one transaction's session, each event hung on to the one before."""

    def __init__(self, session: Session, now: datetime) -> None:
        self._session, self._now = session, now
        self._digest: str | None = None

    def write(self, entry: Entry) -> None:
        """Add the entry's rows."""
        if isinstance(entry, Event):
            self._event(entry)
        else:
            apply(self._session, entry, self._now)

    def _event(self, event: Event) -> None:
        row = _event_row(event, self._now)
        previous = newest_digest(self._session) if self._digest is None else self._digest
        row.digest = self._digest = digest_of(previous, row)
        self._session.add(row)
        _apply_state(self._session, event, self._now)


def apply(session: Session, entry: Entry, now: datetime) -> None:
    """Add the rows of an entry that is no event to ``session``."""
    match entry:
        case CheckpointEntry():
            document = jsonable(_fields(entry.checkpoint) | {"drones": [*map(_fields, entry.checkpoint.drones)]})
            campaign_id = clean_text(entry.checkpoint.campaign_id)[:64]
            session.merge(CheckpointRow(campaign_id=campaign_id, document=document, taken_at=entry.taken_at))
        case DecisionEntry():
            document, slot = decision_document(entry.record), entry.record.slot
            session.add(DecisionRow(campaign_id=entry.campaign_id, slot=slot, document=document, recorded_at=now))
        case SetpointsEntry():
            document = jsonable([*map(_fields, entry.told)])
            row = SetpointsRow(campaign_id=entry.campaign_id, slot=entry.slot, document=document, recorded_at=now)
            session.add(row)
        case TelemetryEntry():
            session.add(_telemetry_row(entry, now))
        case SlotEntry():
            session.merge(_slot_row(entry, now))  # a resumed campaign may tell its last slot again
        case CommandEntry():
            session.add(_command_row(entry, now))
        case UploadEntry():
            session.add(UploadRow(**asdict(entry) | {"user_id": clean_text(entry.user_id)}, recorded_at=now))


def _fields(flat: Any) -> dict[str, Any]:
    """A dataclass whose fields hold no others, by name; ``asdict`` copies each value and takes ten times as long."""
    return dict(vars(flat))


def _event_row(event: Event, now: datetime) -> EventRow:
    return EventRow(
        recorded_at=now,
        time_s=event.time_s,
        kind=clean_text(event.kind)[:64],
        severity=event.severity.value,
        message=clean_text(event.message),
        campaign_id=None if event.campaign_id is None else clean_text(event.campaign_id)[:64],
        system_id=event.system_id,
        actor=clean_text(event.actor),
        data=jsonable(event.data),
    )


def _apply_state(session: Session, event: Event, now: datetime) -> None:
    """The campaign's row follows the events that tell its state."""
    state = event.data.get("state")
    if event.kind != STATE_KIND or event.campaign_id is None or str(state) not in STATES:
        return
    reason = clean_text(str(event.data.get("reason") or event.message.partition(": ")[2]))  # "flying -> failed: why"
    changed = update(CampaignRow).where(CampaignRow.id == event.campaign_id)
    session.execute(changed.values(state=str(state), reason=reason, updated_at=now))


def _slot_row(entry: SlotEntry, now: datetime) -> SlotRow:
    record = entry.record
    metrics: Mapping[str, Any] | None = None if record.metrics is None else asdict(record.metrics)
    return SlotRow(
        campaign_id=entry.campaign_id,
        slot=record.slot,
        time_s=record.time_s,
        uavs=jsonable([*map(_fields, record.uavs)]),
        users=jsonable([*map(_fields, record.users)]),
        metrics=jsonable(metrics),
        decision_ms=record.decision_ms,
        recorded_at=now,
    )


def _telemetry_row(entry: TelemetryEntry, now: datetime) -> TelemetryRow:
    sample = entry.sample
    vehicles = vehicle_rows(sample.vehicles)
    return TelemetryRow(campaign_id=entry.campaign_id, time_s=sample.time_s, vehicles=vehicles, recorded_at=now)


def _command_row(entry: CommandEntry, now: datetime) -> CommandRow:
    verdict, command = entry.verdict, entry.verdict.command
    return CommandRow(
        recorded_at=now,
        actor=clean_text(entry.actor),
        system_id=command.system_id,
        command=command.kind.value,
        altitude_m=command.altitude_m,
        force=command.force,
        result=verdict.result.value,
        reason=clean_text(verdict.reason),
        attempts=verdict.attempts,
        duration_s=verdict.duration_s,
    )
