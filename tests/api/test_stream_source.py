"""What is said of a tick and of an event: made once for all clients, and the same as if made for each."""

import json

from test_stream_session import Client

from gcs.api.auth import Actor
from gcs.api.deltas import told
from gcs.api.stream_session import StreamSession
from gcs.api.stream_source import EVENTS_KEPT, change_text
from gcs.ports import Event
from gcs.store.keys import Role


def another(client: Client) -> StreamSession:
    """A second client of the same source."""
    session = client.session
    return StreamSession(Actor("bob", Role.VIEWER), "1.0", client.source, client.tail, session.statics, session.wish)


def flying(*, deltas: bool) -> tuple[Client, list[StreamSession]]:
    """Three clients who have had the first slot's users."""
    client = Client(deltas=deltas)
    client.start("first")
    client.control.end_slot(1)
    sessions = [client.session, another(client), another(client)]
    for session in sessions:
        assert any('"users":[' in text for text in session.step())
    return client, sessions


def test_where_a_slot_ends_all_clients_of_deltas_get_one_text_with_the_users() -> None:
    client, sessions = flying(deltas=True)
    before = client.source.newest()
    client.control.end_slot(2)
    (text,), *others = [session.step() for session in sessions]
    assert all(other[0] is text for other in others)
    now = client.source.newest()
    assert now.message.campaign is not None
    campaign = now.message.campaign.model_copy(update={"users": now.users.views})
    alone = change_text(before.told, told(now.message.model_copy(update={"campaign": campaign})))
    assert json.loads(text) == json.loads(alone)
    client.control.tick()
    assert "users" not in json.loads(client.session.step()[0])["campaign"]


def test_a_newcomer_gets_all_of_the_tick_that_others_get_the_change_of() -> None:
    client, sessions = flying(deltas=True)
    client.control.end_slot(2)
    late = another(client)
    change, *_ = sessions[0].step()
    _, whole = late.step()
    assert (json.loads(change)["type"], json.loads(whole)["type"]) == ("delta", "snapshot")
    assert json.loads(whole)["campaign"]["users"] == json.loads(change)["campaign"]["users"]


def test_whole_snapshots_with_users_are_one_text_too() -> None:
    client, sessions = flying(deltas=False)
    client.control.end_slot(2)
    (text,), *others = [session.step() for session in sessions]
    assert all(other[0] is text for other in others)
    assert json.loads(text)["campaign"]["users"]
    assert json.loads(sessions[0].step()[0])["campaign"]["users"] is None


def test_users_in_words_are_made_once_a_slot() -> None:
    client, _ = flying(deltas=True)
    users = client.source.newest().users
    client.control.tick()
    assert client.source.newest().users is users
    client.control.end_slot(2)
    assert client.source.newest().users is not users


def test_an_event_is_put_into_words_once_and_not_kept_for_ever() -> None:
    client = Client(topics=["events"])
    other = another(client)
    client.tail.append(Event(1.0, "plan.late", "late"))
    (text,), (same,) = client.session.step(), other.step()
    assert text is same
    assert json.loads(text)["message"] == "late"
    for index in range(EVENTS_KEPT + 1):
        client.tail.append(Event(float(index), "plan.late", str(index)))
        client.session.step()
    (first,) = client.tail.since(0, 1)
    assert client.source.event(first) is not text
    assert json.loads(client.source.event(first)) == json.loads(text)
