"""One client of the stream, without its socket: what it asked for, what it was told, what it is to be told now.

There is no queue. Each step takes the newest snapshot and the events after the last one told, so a slow client skips
snapshots, sees gaps in the events' numbers when it is slower than the tail, and holds up nobody. What is said of a
tick is made once, whoever asks: a hundred vehicles for twenty clients would take the flight's share of the processor.
"""

import json
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol, cast

from pydantic import TypeAdapter, ValidationError

from gcs.api.auth import Actor
from gcs.api.deltas import delta, plans_told, told
from gcs.api.schemas import (
    CampaignMessage,
    CampaignStatic,
    HelloMessage,
    Message,
    ProblemMessage,
    RoleName,
    SnapshotMessage,
    Subscribe,
    Topic,
    UserView,
    VehicleView,
)
from gcs.api.views import event_message, plan_views, snapshot_message, user_views
from gcs.ports import FlightControl, FlightSnapshot, UavPlan
from gcs.store.event_tail import EventTail
from policy.world.frames import LocalFrame

BACKLOG = 100  # events that a new client gets of what was before
MAX_EVENTS = 200  # a step
VEHICLES: TypeAdapter[list[VehicleView]] = TypeAdapter(list[VehicleView])


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


@dataclass
class Tick:
    """A snapshot in the stream's words, without users; its texts are made when they are first asked for."""

    message: SnapshotMessage
    users: list[UserView]
    plans: Plans
    _text: str | None = None
    _vehicles_json: bytes | None = None
    _told: dict[str, Any] | None = None
    _changes: dict[int, tuple[dict[str, Any], str]] = field(default_factory=dict)  # by the identity of what was before
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def text(self) -> str:
        """The whole message as JSON."""
        with self._lock:
            self._text = self._text or _json(self.message)
            return self._text

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

    def change(self, before: dict[str, Any] | None) -> str:
        """What turns ``before``, an earlier tick's :attr:`told`, into this one's."""
        now = self.told
        with self._lock:
            known = self._changes.get(id(before))
            if known is None or known[0] is not before:
                text = change_text(before, now)
                if before is None:
                    return text
                self._changes[id(before)] = known = (before, text)  # holds it, so that no other gets its identity
            return known[1]


class SnapshotSource:
    """The newest snapshot in the stream's words, made once a tick however many clients there are."""

    def __init__(self, control: FlightControl, tail: EventTail, statics: Statics) -> None:
        self._control, self._tail, self._statics = control, tail, statics
        self._lock = threading.Lock()
        self._newest: tuple[FlightSnapshot, bool, Tick] | None = None
        self._plans = Plans(())

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
            users = [] if campaign is None or campaign.latest is None else user_views(campaign.latest)
            tick = Tick(message, users, self._plans)
            self._newest = (snapshot, healthy, tick)
            return tick


@dataclass
class StreamSession:
    """What this client was told last, and what it wants."""

    actor: Actor
    version: str
    source: SnapshotSource
    tail: EventTail
    statics: Statics
    wish: Subscribe
    _told_campaign: str | None = None
    _told_users: tuple[str, int] | None = None
    _base: dict[str, Any] | None = None  # the snapshot that a client of deltas has
    _told_event: int = field(init=False)

    def __post_init__(self) -> None:
        self._told_event = max(0, self.tail.last_sequence - BACKLOG)

    def hello(self) -> str:
        """The first message."""
        campaign = self._new_campaign(self.source.newest().message)
        return _json(
            HelloMessage(
                version=self.version,
                role=cast("RoleName", self.actor.role.value),  # a reporter is not let in
                actor=self.actor.name,
                rate_hz=self.wish.rate_hz,
                topics=list(self.wish.topics),
                campaign=campaign,
            )
        )

    def hear(self, text: str) -> str | None:
        """Take in what the client said; the answer when it is not understood."""
        try:
            self.wish = Subscribe.model_validate_json(text)
        except ValidationError as error:
            first = error.errors(include_input=False, include_url=False)[0]
            where = ".".join(map(str, first["loc"])) or "message"
            return _json(ProblemMessage(detail=f"{where[:100]}: {first['msg']}"))
        return None

    def at_hand(self) -> bool:
        """:meth:`step` would wait for nothing."""
        return not self._wants("snapshot") or self.source.at_hand()

    def step(self) -> list[str]:
        """What is to be said now."""
        snapshot = self._snapshot() if self._wants("snapshot") else ()
        events = self._events() if self._wants("events") else ()
        return [*snapshot, *events]

    def _wants(self, topic: Topic) -> bool:
        return topic in self.wish.topics

    def _snapshot(self) -> Iterator[str]:
        tick = self.source.newest()
        campaign = self._new_campaign(tick.message)
        if campaign is not None:
            yield _json(CampaignMessage(campaign=campaign))
        yield self._told(tick)

    def _told(self, tick: Tick) -> str:
        """Whole, or what changed since the last one."""
        message = self._with_users(tick)
        if not self.wish.deltas:
            self._base = None
            return tick.text if message is tick.message else _json(message)
        before, self._base = self._base, tick.told  # without users: who is told them once is not told that they went
        return tick.change(before) if message is tick.message else change_text(before, told(message))

    def _new_campaign(self, message: SnapshotMessage) -> CampaignStatic | None:
        campaign_id = None if message.campaign is None else message.campaign.campaign_id
        if campaign_id is None or campaign_id == self._told_campaign:
            return None
        self._told_campaign = campaign_id
        return self.statics.static(campaign_id)

    def _with_users(self, tick: Tick) -> SnapshotMessage:
        """For who has not had the users of this slot; else the message that everybody gets."""
        message, campaign = tick.message, tick.message.campaign
        if campaign is None or campaign.users_slot is None:
            return message
        place = (campaign.campaign_id, campaign.users_slot)
        if place == self._told_users:
            return message
        self._told_users = place
        return message.model_copy(update={"campaign": campaign.model_copy(update={"users": tick.users})})

    def _events(self) -> Iterator[str]:
        for numbered in self.tail.since(self._told_event, MAX_EVENTS):
            self._told_event = numbered.sequence
            yield _json(event_message(numbered))


def change_text(before: dict[str, Any] | None, now: dict[str, Any]) -> str:
    """The change as JSON, or all of ``now`` where nothing before fits."""
    change = delta(before, now)
    return json.dumps(now, separators=(",", ":"), allow_nan=False) if change is None else _json(change)


def _json(message: Message) -> str:
    return message.model_dump_json()
