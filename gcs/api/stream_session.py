"""One client of the stream, without its socket: what it asked for, what it was told, what it is to be told now.

There is no queue. Each step takes the newest snapshot and the events after the last one told, so a slow client skips
snapshots, sees gaps in the events' numbers when it is slower than the tail, and holds up nobody. What is said of a
tick is made once, whoever asks (``gcs.api.stream_source``).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, cast

from pydantic import ValidationError

from gcs.api.auth import Actor
from gcs.api.schemas import (
    CampaignMessage,
    CampaignStatic,
    HelloMessage,
    ProblemMessage,
    RoleName,
    SnapshotMessage,
    Subscribe,
    Topic,
)
from gcs.api.stream_source import SnapshotSource, Statics, Tick, as_json
from gcs.store.event_tail import EventTail

BACKLOG = 100  # events that a new client gets of what was before
MAX_EVENTS = 200  # a step


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
        return as_json(
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
            return as_json(ProblemMessage(detail=f"{where[:100]}: {first['msg']}"))
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
            yield as_json(CampaignMessage(campaign=campaign))
        yield self._told(tick)

    def _told(self, tick: Tick) -> str:
        """Whole, or what changed since the last one."""
        with_users = self._wants_users(tick.message)
        if not self.wish.deltas:
            self._base = None
            return tick.text(with_users=with_users)
        before, self._base = self._base, tick.told  # without users: who is told them once is not told that they went
        return tick.change(before, with_users=with_users)

    def _new_campaign(self, message: SnapshotMessage) -> CampaignStatic | None:
        campaign_id = None if message.campaign is None else message.campaign.campaign_id
        if campaign_id is None or campaign_id == self._told_campaign:
            return None
        self._told_campaign = campaign_id
        return self.statics.static(campaign_id)

    def _wants_users(self, message: SnapshotMessage) -> bool:
        """This client has not had the users of this slot; it has from now on."""
        campaign = message.campaign
        if campaign is None or campaign.users_slot is None:
            return False
        before, self._told_users = self._told_users, (campaign.campaign_id, campaign.users_slot)
        return self._told_users != before

    def _events(self) -> Iterator[str]:
        for numbered in self.tail.since(self._told_event, MAX_EVENTS):
            self._told_event = numbered.sequence
            yield self.source.event(numbered)
