"""What the stream says of a tick and of an event, made once for all clients.

A hundred vehicles in words for twenty clients, each by itself, would take the flight's share of the processor; users
and events come to all of them at once where a slot begins, which is when the flight has most to do.
"""

import json
import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol, TypeAlias

from pydantic import TypeAdapter

from gcs.api.deltas import delta, plans_told, told, users_told
from gcs.api.schemas import CampaignStatic, Message, SnapshotMessage, VehicleView
from gcs.api.views import event_message, plan_views, snapshot_message, user_views
from gcs.ports import FlightControl, FlightSnapshot, SlotRecord, UavPlan
from gcs.store.event_tail import EventTail, NumberedEvent
from policy.world.frames import LocalFrame

EVENTS_KEPT = 500  # texts, for who asks for the same ones a moment later
VEHICLES: TypeAdapter[list[VehicleView]] = TypeAdapter(list[VehicleView])
_Change: TypeAlias = tuple[dict[str, Any] | None, str]
"""What was told before, None: nothing; and what turns it into what is told now."""


class Statics(Protocol):
    """Where a session looks up what does not change about a campaign."""

    def static(self, campaign_id: str) -> CampaignStatic | None: ...

    def frame(self, campaign_id: str) -> LocalFrame | None: ...

    def battery_j(self, campaign_id: str) -> float | None: ...

    def at_hand(self, campaign_id: str) -> bool: ...


class Plans:
    """What the UAVs do in a slot, in the stream's words: the same at each tick of it, and most of a tick's numbers."""

    def __init__(self, plans: Sequence[UavPlan]) -> None:
        self.plans, self.views = plans, plan_views(plans)

    @cached_property
    def told(self) -> list[dict[str, Any]]:
        """As clients of deltas know them."""
        return plans_told(self.views)


class Users:
    """Where everybody was at the end of a slot, in the stream's words: the same until the next one ends."""

    def __init__(self, record: SlotRecord | None) -> None:
        self.record, self.views = record, [] if record is None else user_views(record)

    @cached_property
    def told(self) -> list[dict[str, Any]]:
        """As clients of deltas know them."""
        return users_told(self.views)


@dataclass
class Tick:
    """A snapshot in the stream's words, without users; its texts are made when they are first asked for.

    All clients who have had the same before are told the same, with users too: at a slot's end that is everybody.
    """

    message: SnapshotMessage
    users: Users
    plans: Plans
    _texts: dict[bool, str] = field(default_factory=dict)  # without and with users
    _vehicles_json: bytes | None = None
    _told: dict[str, Any] | None = None
    _changes: dict[tuple[int, bool], _Change] = field(default_factory=dict)  # by the identity of what was before
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def text(self, *, with_users: bool) -> str:
        """The whole message as JSON."""
        with self._lock:
            if with_users not in self._texts:
                self._texts[with_users] = as_json(self._with_users() if with_users else self.message)
            return self._texts[with_users]

    def _with_users(self) -> SnapshotMessage:
        campaign = self.message.campaign
        assert campaign is not None
        return self.message.model_copy(update={"campaign": campaign.model_copy(update={"users": self.users.views})})

    @property
    def vehicles_json(self) -> bytes:
        """The vehicles alone, as JSON."""
        with self._lock:
            self._vehicles_json = self._vehicles_json or VEHICLES.dump_json(self.message.vehicles)
            return self._vehicles_json

    @property
    def told(self) -> dict[str, Any]:
        """As a client that takes deltas knows it; shared by all of them, never changed."""
        with self._lock:
            self._told = self._told or told(self.message, self.plans.told)
            return self._told

    def change(self, before: dict[str, Any] | None, *, with_users: bool = False) -> str:
        """What turns ``before``, an earlier tick's :attr:`told`, into this one's; ``with_users``: and who was where."""
        now = self.told
        with self._lock:
            known = self._changes.get((id(before), with_users))
            if known is None or known[0] is not before:
                if with_users:
                    now = now | {"campaign": now["campaign"] | {"users": self.users.told}}
                known = (before, change_text(before, now))  # holds it, so that no other gets its identity
                self._changes[(id(before), with_users)] = known
            return known[1]


class SnapshotSource:
    """The newest snapshot in the stream's words, made once a tick however many clients there are."""

    def __init__(self, control: FlightControl, tail: EventTail, statics: Statics) -> None:
        self._control, self._tail, self._statics = control, tail, statics
        self._lock = threading.Lock()
        self._newest: tuple[FlightSnapshot, bool, Tick] | None = None
        self._plans, self._users = Plans(()), Users(None)
        self._events: OrderedDict[int, str] = OrderedDict()
        self._events_lock = threading.Lock()

    def at_hand(self) -> bool:
        """:meth:`newest` would wait for nothing: the campaign's mission need not be read from the store."""
        campaign = self._control.snapshot().campaign
        return campaign is None or self._statics.at_hand(campaign.campaign_id)

    def newest(self) -> Tick:
        """The message without users, and the users to add for who has not had them."""
        snapshot, healthy = self._control.snapshot(), self._control.healthy()
        campaign = snapshot.campaign
        known = self._newest
        if known is not None and known[0] is snapshot and known[1] == healthy:
            return known[2]
        frame = None if campaign is None else self._statics.frame(campaign.campaign_id)  # may wait: not with the lock
        battery_j = None if campaign is None else self._statics.battery_j(campaign.campaign_id)
        with self._lock:
            newest = self._newest
            if newest is not None and newest[0] is snapshot and newest[1] == healthy:
                return newest[2]
            verdicts = self._tail.verdicts()
            if campaign is not None and campaign.plans != self._plans.plans:
                self._plans = Plans(campaign.plans)
            message = snapshot_message(
                snapshot,
                healthy=healthy,
                frame=frame,
                verdicts=verdicts,
                battery_j=battery_j,
                plans=self._plans.views,
            )
            latest = None if campaign is None else campaign.latest
            if latest is not self._users.record:
                self._users = Users(latest)
            tick = Tick(message, self._users, self._plans)
            self._newest = (snapshot, healthy, tick)
            return tick

    def event(self, numbered: NumberedEvent) -> str:
        """One event as JSON."""
        with self._events_lock:
            if numbered.sequence not in self._events:
                self._events[numbered.sequence] = as_json(event_message(numbered))
                while len(self._events) > EVENTS_KEPT:
                    self._events.popitem(last=False)
            return self._events[numbered.sequence]


def change_text(before: dict[str, Any] | None, now: dict[str, Any]) -> str:
    """The change as JSON, or all of ``now`` where nothing before fits."""
    change = delta(before, now)
    return json.dumps(now, separators=(",", ":"), allow_nan=False) if change is None else as_json(change)


def as_json(message: Message) -> str:
    """As it is sent."""
    return message.model_dump_json()
