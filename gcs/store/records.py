"""What the store answers with: frozen values, no rows that need a session."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from datetime import datetime
from typing import Any

from sqlalchemy import Row

from gcs.ports import CampaignState, Checkpoint, DroneCheckpoint, SlotRecord, UavSlot, UserSlot
from gcs.store.models import CampaignRow, EventRow, SlotRow
from policy.world.metrics import Metrics

TERMINAL = frozenset({CampaignState.DONE, CampaignState.ABORTED, CampaignState.FAILED})


@dataclass(frozen=True)
class CampaignRecord:
    """A campaign as recorded."""

    id: str
    name: str
    policy: str
    user_source: str
    state: CampaignState
    reason: str
    document: Mapping[str, Any]
    directory: str | None
    slots: int
    slot_s: float
    created_by: str
    created_at: datetime
    updated_at: datetime
    places_wiped_at: datetime | None = None

    @property
    def over(self) -> bool:
        """Nothing more will happen to it."""
        return self.state in TERMINAL


@dataclass(frozen=True)
class EventRecord:
    """An event as recorded."""

    id: int
    recorded_at: datetime
    time_s: float
    kind: str
    severity: str
    message: str
    campaign_id: str | None
    system_id: int | None
    actor: str
    data: Mapping[str, Any]


_CAMPAIGN_FIELDS = tuple(field.name for field in fields(CampaignRecord))
_EVENT_FIELDS = tuple(field.name for field in fields(EventRecord))


def campaign_record(row: CampaignRow) -> CampaignRecord:
    """Row to value."""
    values = {name: getattr(row, name) for name in _CAMPAIGN_FIELDS}
    return CampaignRecord(**values | {"state": CampaignState(row.state)})


def event_record(row: EventRow | Row[Any]) -> EventRecord:
    """Row to value."""
    return EventRecord(**{name: getattr(row, name) for name in _EVENT_FIELDS})


def slot_record(row: SlotRow) -> SlotRecord:
    """Row to the value that was recorded."""
    return SlotRecord(
        slot=row.slot,
        time_s=row.time_s,
        uavs=tuple(UavSlot(**_with_nan(uav)) for uav in row.uavs),
        users=tuple(UserSlot(**_with_nan(user)) for user in row.users),
        metrics=recorded_metrics(row.metrics),
        decision_ms=row.decision_ms,
    )


def recorded_checkpoint(document: Mapping[str, Any]) -> Checkpoint:
    """A checkpoint as stored."""
    drones = tuple(
        DroneCheckpoint(**drone | {"pad_m": None if drone["pad_m"] is None else tuple(drone["pad_m"])})
        for drone in document["drones"]
    )
    return Checkpoint(**dict(document) | {"state": CampaignState(document["state"]), "drones": drones})


def recorded_metrics(values: Mapping[str, Any] | None) -> Metrics | None:
    """Metrics as stored."""
    return None if values is None else Metrics(**_with_nan(values))


def _with_nan(values: Mapping[str, Any]) -> dict[str, Any]:
    """JSON has no NaN, so a number that was none is stored as null."""
    return {key: math.nan if value is None else value for key, value in values.items()}
