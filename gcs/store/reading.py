"""Reading what the journal wrote: events, slots, orders and receipts."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import Engine, func, select
from sqlalchemy.orm import Session

from gcs.ports import Checkpoint, DecisionRecord, SetpointSummary, Severity, SlotRecord
from gcs.store.decision_documents import recorded_decision
from gcs.store.models import CheckpointRow, CommandRow, DecisionRow, EventRow, SetpointsRow, SlotRow, UploadRow
from gcs.store.records import (
    EventRecord,
    event_record,
    recorded_checkpoint,
    recorded_metrics,
    slot_record,
)
from policy.world.metrics import Metrics

RANK = {Severity.INFO: 0, Severity.CAUTION: 1, Severity.WARNING: 2}


@dataclass(frozen=True)
class EventFilter:
    """None means any; ``min_severity`` and all above it, ``since`` and later, ids above ``after_id``."""

    campaign_id: str | None = None
    min_severity: Severity | None = None
    kind: str | None = None
    since: datetime | None = None
    after_id: int | None = None


@dataclass(frozen=True)
class Events:
    """The audit log."""

    engine: Engine

    def find(self, wanted: EventFilter, limit: int = 1_000, offset: int = 0) -> Sequence[EventRecord]:
        """In the order in which they were recorded."""
        query = select(EventRow.__table__).where(*_conditions(wanted)).order_by(EventRow.id)
        with self.engine.connect() as connection:  # a page asks often: plain rows take half the time of mapped ones
            return [event_record(row) for row in connection.execute(query.limit(limit).offset(offset))]

    def during(self, campaign_id: str, first: datetime, last: datetime, limit: int) -> Sequence[EventRecord]:
        """All of a campaign, and what belongs to none but was recorded while it was flown, such as a latched stop."""
        meanwhile = EventRow.campaign_id.is_(None) & EventRow.recorded_at.between(first, last)
        query = select(EventRow).where((EventRow.campaign_id == campaign_id) | meanwhile)
        with Session(self.engine) as session:
            return [event_record(row) for row in session.scalars(query.order_by(EventRow.id).limit(limit))]

    def count(self, wanted: EventFilter) -> int:
        """How many match."""
        with Session(self.engine) as session:
            return session.scalar(select(func.count(EventRow.id)).where(*_conditions(wanted))) or 0


def _conditions(wanted: EventFilter) -> list[Any]:
    conditions: list[Any] = []
    if wanted.campaign_id is not None:
        conditions.append(EventRow.campaign_id == wanted.campaign_id)
    if wanted.min_severity is not None:
        least = RANK[wanted.min_severity]
        conditions.append(EventRow.severity.in_([s.value for s, rank in RANK.items() if rank >= least]))
    if wanted.kind is not None:
        conditions.append(EventRow.kind == wanted.kind)
    if wanted.since is not None:
        conditions.append(EventRow.recorded_at >= wanted.since)
    if wanted.after_id is not None:
        conditions.append(EventRow.id > wanted.after_id)
    return conditions


@dataclass(frozen=True)
class SlotTime:
    """The end of a slot: on the flight clock of the server that flew it, and on the wall clock."""

    slot: int
    time_s: float
    recorded_at: datetime


@dataclass(frozen=True)
class Slots:
    """The slots of campaigns."""

    engine: Engine

    def of(self, campaign_id: str) -> Sequence[SlotRecord]:
        """All slots of a campaign, in order."""
        query = select(SlotRow).where(SlotRow.campaign_id == campaign_id).order_by(SlotRow.slot)
        with Session(self.engine) as session:
            return [slot_record(row) for row in session.scalars(query)]

    def part(self, campaign_id: str, first: int, limit: int) -> Sequence[SlotRecord]:
        """At most ``limit`` slots from number ``first`` on, in order."""
        wanted = (SlotRow.campaign_id == campaign_id) & (SlotRow.slot >= first)
        with Session(self.engine) as session:
            rows = session.scalars(select(SlotRow).where(wanted).order_by(SlotRow.slot).limit(limit))
            return [slot_record(row) for row in rows]

    def times(self, campaign_id: str) -> Sequence[SlotTime]:
        """When each slot ended, in order, without reading what happened in it."""
        columns = (SlotRow.slot, SlotRow.time_s, SlotRow.recorded_at)
        query = select(*columns).where(SlotRow.campaign_id == campaign_id).order_by(SlotRow.slot)
        with Session(self.engine) as session:
            return [SlotTime(*row) for row in session.execute(query)]

    def progress(self, campaign_id: str) -> tuple[int, Metrics | None]:
        """The newest slot's number and the metrics so far, without reading every user; (0, None) before the start."""
        query = select(SlotRow.slot, SlotRow.metrics).where(SlotRow.campaign_id == campaign_id)
        with Session(self.engine) as session:
            row = session.execute(query.order_by(SlotRow.slot.desc()).limit(1)).first()
        return (0, None) if row is None else (row.slot, recorded_metrics(row.metrics))


@dataclass(frozen=True)
class DecisionMoment:
    """A decision and when it was made; ``time_s`` as of gcs.api.recorded_clock.Moment."""

    id: int
    decision: DecisionRecord
    recorded_at: datetime

    @property
    def time_s(self) -> float:
        """On the flight clock of the server that flew; NaN where an older version did not note it."""
        return self.decision.time_s


@dataclass(frozen=True)
class Checkpoints:
    """What campaigns in the air are taken up from, and what was decided in them."""

    engine: Engine

    def of(self, campaign_id: str) -> tuple[Checkpoint, datetime] | None:
        """The newest checkpoint and the wall clock's time when it was taken; None when there is none."""
        with Session(self.engine) as session:
            row = session.get(CheckpointRow, campaign_id)
            return None if row is None else (recorded_checkpoint(row.document), row.taken_at)

    def decisions(self, campaign_id: str) -> Sequence[DecisionRecord]:
        """In the order in which they were made; a slot that was taken up again has two."""
        query = select(DecisionRow.document).where(DecisionRow.campaign_id == campaign_id).order_by(DecisionRow.id)
        with Session(self.engine) as session:
            return [recorded_decision(document) for document in session.scalars(query)]

    def decision_documents(self, campaign_id: str) -> Sequence[dict[str, Any]]:
        """As stored, in the order in which they were made, for an export."""
        query = select(DecisionRow.document).where(DecisionRow.campaign_id == campaign_id).order_by(DecisionRow.id)
        with Session(self.engine) as session:
            return list(session.scalars(query))

    def decisions_part(self, campaign_id: str, first: int, limit: int) -> Sequence[DecisionMoment]:
        """At most ``limit`` decisions from id ``first`` on, flown or not."""
        wanted = (DecisionRow.campaign_id == campaign_id) & (DecisionRow.id >= first)
        with Session(self.engine) as session:
            rows = session.scalars(select(DecisionRow).where(wanted).order_by(DecisionRow.id).limit(limit))
            return [DecisionMoment(row.id, recorded_decision(row.document), row.recorded_at) for row in rows]

    def setpoints(self, campaign_id: str) -> Sequence[tuple[int, tuple[SetpointSummary, ...]]]:
        """(slot, a line a UAV) in the order of recording; see ports.Journal.record_setpoints."""
        query = select(SetpointsRow).where(SetpointsRow.campaign_id == campaign_id).order_by(SetpointsRow.id)
        with Session(self.engine) as session:
            rows = list(session.scalars(query))
        return [(row.slot, tuple(SetpointSummary(**line) for line in row.document)) for row in rows]

    def stop_latched(self) -> bool:
        """The newest word on the emergency stop of the whole fleet was to stop."""
        return None in self._stopped()

    def stopped_ones(self) -> tuple[int, ...]:
        """Drones that were stopped one by one, and not reset since, alone or with all."""
        return tuple(sorted(who for who in self._stopped() if who is not None))

    def _stopped(self) -> set[int | None]:
        """Who is stopped; None stands for all."""
        query = select(EventRow.kind, EventRow.system_id).where(EventRow.kind.in_(["safety.stop", "safety.stop_reset"]))
        stopped: set[int | None] = set()
        with Session(self.engine) as session:
            for kind, system_id in session.execute(query.order_by(EventRow.id)):
                if kind == "safety.stop":
                    stopped.add(system_id)
                elif system_id is None:
                    stopped.clear()
                else:
                    stopped.discard(system_id)
        return stopped


@dataclass(frozen=True)
class Orders:
    """What operators ordered, and what the vehicles said."""

    engine: Engine

    def newest(self, limit: int = 100) -> Sequence[CommandRow]:
        """Newest first; rows are detached and complete."""
        with Session(self.engine, expire_on_commit=False) as session:
            return list(session.scalars(select(CommandRow).order_by(CommandRow.id.desc()).limit(limit)))


@dataclass(frozen=True)
class Uploads:
    """Receipts of live users."""

    engine: Engine

    def of(self, campaign_id: str) -> Sequence[UploadRow]:
        """In the order of upload; rows are detached and complete."""
        query = select(UploadRow).where(UploadRow.campaign_id == campaign_id).order_by(UploadRow.uploaded_at)
        with Session(self.engine, expire_on_commit=False) as session:
            return list(session.scalars(query))
