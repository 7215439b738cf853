"""One client of the stream, without its socket: what it asked for, what it was told, what it is to be told now.

There is no queue. Each step takes the newest snapshot and the events after the last one told, so a slow client skips
snapshots, sees gaps in the events' numbers when it is slower than the tail, and holds up nobody.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Protocol, cast

from pydantic import ValidationError

from gcs.api.auth import Actor
from gcs.api.deltas import delta, told
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
)
from gcs.api.views import event_message, snapshot_message, user_views
from gcs.ports import FlightControl, FlightSnapshot
from gcs.store.event_tail import EventTail
from policy.world.frames import LocalFrame

BACKLOG = 100  # events that a new client gets of what was before
MAX_EVENTS = 200  # a step


class Statics(Protocol):
    """Where a session looks up what does not change about a campaign."""

    def static(self, campaign_id: str) -> CampaignStatic | None: ...

    def frame(self, campaign_id: str) -> LocalFrame | None: ...

    def battery_j(self, campaign_id: str) -> float | None: ...


class SnapshotSource:
    """The newest snapshot in the stream's words, made once a tick however many clients there are."""

    def __init__(self, control: FlightControl, tail: EventTail, statics: Statics) -> None:
        self._control, self._tail, self._statics = control, tail, statics
        self._made_of: tuple[FlightSnapshot, bool] | None = None
        self._message: SnapshotMessage | None = None
        self._users: list[UserView] = []

    def newest(self) -> tuple[SnapshotMessage, list[UserView]]:
        """The message without users, and the users to add for who has not had them."""
        snapshot, healthy = self._control.snapshot(), self._control.healthy()
        made_of = self._made_of
        if self._message is None or made_of is None or made_of[0] is not snapshot or made_of[1] != healthy:
            campaign = snapshot.campaign
            frame = None if campaign is None else self._statics.frame(campaign.campaign_id)
            battery_j = None if campaign is None else self._statics.battery_j(campaign.campaign_id)
            verdicts = self._tail.verdicts()
            self._message = snapshot_message(
                snapshot, healthy=healthy, frame=frame, verdicts=verdicts, battery_j=battery_j
            )
            self._users = [] if campaign is None or campaign.latest is None else user_views(campaign.latest)
            self._made_of = (snapshot, healthy)
        return self._message, self._users


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
        campaign = self._new_campaign(self.source.newest()[0])
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

    def step(self) -> Iterator[str]:
        """What is to be said now."""
        if self._wants("snapshot"):
            yield from self._snapshot()
        if self._wants("events"):
            yield from self._events()

    def _wants(self, topic: Topic) -> bool:
        return topic in self.wish.topics

    def _snapshot(self) -> Iterator[str]:
        message, users = self.source.newest()
        campaign = self._new_campaign(message)
        if campaign is not None:
            yield _json(CampaignMessage(campaign=campaign))
        yield self._told(self._with_users(message, users))

    def _told(self, message: SnapshotMessage) -> str:
        """Whole, or what changed since the last one."""
        if not self.wish.deltas:
            self._base = None
            return _json(message)
        before, self._base = self._base, told(message)
        change = delta(before, self._base)
        return json.dumps(self._base, separators=(",", ":"), allow_nan=False) if change is None else _json(change)

    def _new_campaign(self, message: SnapshotMessage) -> CampaignStatic | None:
        campaign_id = None if message.campaign is None else message.campaign.campaign_id
        if campaign_id is None or campaign_id == self._told_campaign:
            return None
        self._told_campaign = campaign_id
        return self.statics.static(campaign_id)

    def _with_users(self, message: SnapshotMessage, users: list[UserView]) -> SnapshotMessage:
        campaign = message.campaign
        if campaign is None or campaign.users_slot is None:
            return message
        place = (campaign.campaign_id, campaign.users_slot)
        if place == self._told_users:
            return message
        self._told_users = place
        return message.model_copy(update={"campaign": campaign.model_copy(update={"users": users})})

    def _events(self) -> Iterator[str]:
        for numbered in self.tail.since(self._told_event, MAX_EVENTS):
            self._told_event = numbered.sequence
            yield _json(event_message(numbered))


def _json(message: Message) -> str:
    return message.model_dump_json()
