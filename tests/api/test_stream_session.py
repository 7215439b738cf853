"""One client of the stream, without its socket."""

import json
from dataclasses import dataclass
from typing import Any

import pytest
from fake_control import FakeControl

from gcs.api.auth import Actor
from gcs.api.catalog import campaign_static
from gcs.api.schemas import CampaignStatic, Subscribe
from gcs.api.stream_session import BACKLOG, StreamSession
from gcs.api.stream_source import SnapshotSource
from gcs.ports import Event, OperatorRequest, RequestKind
from gcs.store.event_tail import EventTail
from gcs.store.keys import Role
from policy.mission_file import Mission, load_mission
from policy.world.frames import LocalFrame

DEMO = load_mission("demo")


@dataclass(frozen=True)
class OneMission:
    """Every campaign is of this mission."""

    mission: Mission

    def static(self, campaign_id: str) -> CampaignStatic | None:
        return campaign_static(campaign_id, self.mission)

    def frame(self, campaign_id: str) -> LocalFrame | None:
        return self.mission.scenario.area.frame

    def battery_j(self, campaign_id: str) -> float | None:
        return self.mission.scenario.battery_j

    def at_hand(self, campaign_id: str) -> bool:
        return True


class Client:
    """A session and what it depends on."""

    def __init__(self, **wish: Any) -> None:
        self.control, self.tail, statics = FakeControl(), EventTail(), OneMission(DEMO)
        self.source = SnapshotSource(self.control, self.tail, statics)
        self.session = StreamSession(
            Actor("ann", Role.VIEWER), "1.0", self.source, self.tail, statics, Subscribe(type="subscribe", **wish)
        )

    def start(self, campaign_id: str) -> None:
        request = OperatorRequest(RequestKind.START, "ann", campaign_id, DEMO)
        assert self.control.submit(request).result().accepted

    def step(self) -> list[dict[str, Any]]:
        return [json.loads(text) for text in self.session.step()]


def test_hello_says_who_the_client_is_and_what_it_will_get() -> None:
    client = Client(rate_hz=2.0)
    hello = json.loads(client.session.hello())
    assert (hello["type"], hello["role"], hello["actor"], hello["rate_hz"]) == ("hello", "viewer", "ann", 2.0)
    assert hello["campaign"] is None


def test_a_campaign_is_described_once_in_hello_or_when_it_begins() -> None:
    client = Client()
    client.start("first")
    hello = json.loads(client.session.hello())
    assert hello["campaign"]["campaign_id"] == "first"
    assert hello["campaign"]["size_m"] == list(DEMO.scenario.area.size_m)
    assert [message["type"] for message in client.step()] == ["snapshot"]
    client.control.finish()
    client.start("second")
    assert [message["type"] for message in client.step()] == ["campaign", "snapshot"]
    assert [message["type"] for message in client.step()] == ["snapshot"]


def test_users_are_sent_when_the_slot_changed_and_only_then() -> None:
    client = Client()
    client.start("first")
    assert client.step()[-1]["campaign"]["users"] is None
    client.control.end_slot(1)
    users = client.step()[-1]["campaign"]["users"]
    assert [user["user_id"] for user in users] == ["u1", "u2"]
    assert (users[1]["east_m"], users[0]["aoi_slots"]) == (None, 3.0)
    client.control.tick()
    again = client.step()[-1]["campaign"]
    assert (again["users"], again["users_slot"]) == (None, 1)
    client.control.end_slot(2)
    assert client.step()[-1]["campaign"]["users"] is not None


def test_a_slow_client_gets_the_newest_snapshot_and_sees_which_events_it_missed() -> None:
    client = Client()
    client.session.hello()
    client.step()
    for index in range(3000):
        client.control.tick()
        client.tail.append(Event(float(index), "plan.late", str(index)))
    messages = client.step()
    assert [m["tick"] for m in messages if m["type"] == "snapshot"] == [client.control.snapshot().tick]
    sequences = [m["sequence"] for m in messages if m["type"] == "event"]
    assert sequences[0] == 1001
    assert len(messages) < 250


def test_a_new_client_gets_some_of_what_was_before() -> None:
    client = Client()
    for index in range(BACKLOG + 50):
        client.tail.append(Event(float(index), "plan.late", str(index)))
    late = StreamSession(
        Actor("bob", Role.VIEWER), "1.0", client.source, client.tail, client.session.statics, client.session.wish
    )
    told = [json.loads(text) for text in late.step() if '"event"' in text]
    assert [message["sequence"] for message in told] == list(range(51, BACKLOG + 51))


def test_topics_are_what_the_client_asked_for() -> None:
    client = Client(topics=["events"])
    client.tail.append(Event(1.0, "plan.late", "late"))
    assert [message["type"] for message in client.step()] == ["event"]
    assert client.session.hear('{"type": "subscribe", "rate_hz": 1, "topics": ["snapshot"]}') is None
    assert [message["type"] for message in client.step()] == ["snapshot"]
    assert client.session.wish.rate_hz == 1.0


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "null",
        '{"type": "fly"}',
        '{"type": "subscribe", "rate_hz": 1e9}',
        '{"type": "subscribe", "x": 1}',
    ],
)
def test_what_is_not_understood_is_told_and_changes_nothing(text: str) -> None:
    client = Client(rate_hz=2.0)
    answer = json.loads(client.session.hear(text) or "{}")
    assert answer["type"] == "problem"
    assert client.session.wish.rate_hz == 2.0


def test_a_snapshot_is_made_once_a_tick_however_many_clients_there_are() -> None:
    client = Client()
    first = client.source.newest()
    assert client.source.newest() is first
    client.control.tick()
    assert client.source.newest() is not first
    client.control.late = True
    assert client.source.newest().message.healthy is False
