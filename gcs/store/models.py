"""Tables: campaigns, their slots, checkpoints, decisions, setpoints and telemetry, the audit log of events, orders
with verdicts, upload receipts, answers kept by key, and API keys.
"""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import JSON, DateTime, Dialect, Double, ForeignKey, Index, String, Text, TypeDecorator
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column


class UtcDateTime(TypeDecorator[datetime]):
    """A moment with its zone; SQLite forgets zones, so everything is stored in UTC and comes back in UTC."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Refuse a naive time: nobody would know what it meant."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"time {value} has no zone: use datetime.now(UTC)")
        return value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Give the zone back."""
        return None if value is None else value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class Base(DeclarativeBase):
    """All tables."""

    type_annotation_map = {dict[str, Any]: JSON, list[Any]: JSON, datetime: UtcDateTime, float: Double}  # noqa: RUF012


class CampaignRow(Base):
    """One campaign: its document as it was given, and how far it came."""

    __tablename__ = "campaigns"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(Text)
    policy: Mapped[str] = mapped_column(Text)
    user_source: Mapped[str] = mapped_column(String(16))
    state: Mapped[str] = mapped_column(String(16), index=True)
    reason: Mapped[str] = mapped_column(Text, default="")
    document: Mapped[dict[str, Any]]
    directory: Mapped[str | None] = mapped_column(Text)  # where traces are looked for
    slots: Mapped[int]
    slot_s: Mapped[float]
    created_by: Mapped[str] = mapped_column(Text)
    created_at: Mapped[datetime] = mapped_column(index=True)
    updated_at: Mapped[datetime]
    places_wiped_at: Mapped[datetime | None]  # gcs.store.privacy


class SlotRow(Base):
    """The state after ``slot`` slots, as in the trajectory file. ``campaign_id`` is no foreign key, see EventRow."""

    __tablename__ = "slots"

    campaign_id: Mapped[str] = mapped_column(String(64), primary_key=True)
    slot: Mapped[int] = mapped_column(primary_key=True)
    time_s: Mapped[float]
    uavs: Mapped[list[Any]]
    users: Mapped[list[Any]]
    metrics: Mapped[dict[str, Any] | None]
    decision_ms: Mapped[float | None]
    recorded_at: Mapped[datetime]


class EventRow(Base):
    """The audit log. ``campaign_id`` is no foreign key: an event is kept even when its campaign is unknown."""

    __tablename__ = "events"
    __table_args__ = (Index("ix_events_campaign_id_id", "campaign_id", "id"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    recorded_at: Mapped[datetime] = mapped_column(index=True)
    time_s: Mapped[float]  # flight clock
    kind: Mapped[str] = mapped_column(String(64), index=True)
    severity: Mapped[str] = mapped_column(String(16))
    message: Mapped[str] = mapped_column(Text)
    campaign_id: Mapped[str | None] = mapped_column(String(64))
    system_id: Mapped[int | None]
    actor: Mapped[str] = mapped_column(Text)
    data: Mapped[dict[str, Any]]
    digest: Mapped[str | None] = mapped_column(String(64))  # gcs.store.chain; None before the log was a chain


class CheckpointRow(Base):
    """What a restarted server takes a campaign in the air up from, beside its slots; the newest one only."""

    __tablename__ = "checkpoints"

    campaign_id: Mapped[str] = mapped_column(String(64), primary_key=True)
    document: Mapped[dict[str, Any]]
    taken_at: Mapped[datetime]


class DecisionRow(Base):
    """What the policy was asked and what it answered; a slot that was taken up again has two."""

    __tablename__ = "decisions"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    campaign_id: Mapped[str] = mapped_column(String(64), index=True)
    slot: Mapped[int]
    document: Mapped[dict[str, Any]]
    recorded_at: Mapped[datetime]


class SetpointsRow(Base):
    """What the UAVs were told, one entry a UAV; a slot that was taken up again has two."""

    __tablename__ = "setpoints"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    campaign_id: Mapped[str] = mapped_column(String(64), index=True)
    slot: Mapped[int]
    document: Mapped[list[Any]]
    recorded_at: Mapped[datetime]


class TelemetryRow(Base):
    """What all vehicles said at one moment, a row a vehicle; gcs.store.vehicle_rows has the columns."""

    __tablename__ = "telemetry"
    __table_args__ = (Index("ix_telemetry_campaign_id_id", "campaign_id", "id"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    campaign_id: Mapped[str] = mapped_column(String(64))
    time_s: Mapped[float]  # flight clock
    vehicles: Mapped[list[Any]]
    recorded_at: Mapped[datetime]


class AnswerRow(Base):
    """The answer to a request with an Idempotency-Key; ``status`` None while the first one is being worked on."""

    __tablename__ = "answers"

    actor: Mapped[str] = mapped_column(String(128), primary_key=True)
    key: Mapped[str] = mapped_column(String(128), primary_key=True)
    request: Mapped[str] = mapped_column(String(64))  # digest of method, path and body
    status: Mapped[int | None]
    body: Mapped[str | None] = mapped_column(Text)
    created_at: Mapped[datetime] = mapped_column(index=True)


class CommandRow(Base):
    """An order that an operator gave to a vehicle, and the vehicle's verdict."""

    __tablename__ = "commands"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    recorded_at: Mapped[datetime]
    actor: Mapped[str] = mapped_column(Text)
    system_id: Mapped[int] = mapped_column(index=True)
    command: Mapped[str] = mapped_column(String(16))
    altitude_m: Mapped[float | None]
    force: Mapped[bool]
    result: Mapped[str] = mapped_column(String(16))
    reason: Mapped[str] = mapped_column(Text)
    attempts: Mapped[int]
    duration_s: Mapped[float]


class UploadRow(Base):
    """A receipt: ``user_id`` uploaded successfully at ``uploaded_at``."""

    __tablename__ = "uploads"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    campaign_id: Mapped[str] = mapped_column(ForeignKey("campaigns.id"), index=True)
    user_id: Mapped[str] = mapped_column(String(64))
    uploaded_at: Mapped[datetime]
    uploaded_mb: Mapped[float | None]
    recorded_at: Mapped[datetime]


class KeyRow(Base):
    """An API key; only a salted hash of its secret is kept."""

    __tablename__ = "api_keys"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    name: Mapped[str] = mapped_column(Text)
    role: Mapped[str] = mapped_column(String(16))
    salt: Mapped[str] = mapped_column(String(32))
    digest: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]
