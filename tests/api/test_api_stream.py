"""The stream over a real WebSocket."""

import json
import socket
import time
from pathlib import Path
from typing import Any

import httpx
import pytest
from api_server import LIVE, Server, serving
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from gcs.api.routes import stream as stream_route
from gcs.api.routes.reports_socket import MESSAGES_PER_S
from gcs.api.server import MAX_CLIENT_MESSAGE_BYTES
from gcs.api.settings import ApiSettings
from gcs.ports import Event
from gcs.store.keys import Role
from gcs.store.store import Store

WAIT_S = 10.0
HTTP_METRIC = "gcs_stream_clients"


def receive(stream: ClientConnection, kind: str) -> dict[str, Any]:
    """The next message of a kind."""
    while True:
        message: dict[str, Any] = json.loads(stream.recv(WAIT_S))
        if message["type"] == kind:
            return message


def bearer(server: Server, role: Role) -> dict[str, str]:
    return {"authorization": f"Bearer {server.keys[role]}"}


def test_hello_then_snapshots_and_events(keyed: Server) -> None:
    with connect(keyed.stream_url + "?rate_hz=20", additional_headers=bearer(keyed, Role.VIEWER), proxy=None) as stream:
        hello = json.loads(stream.recv(WAIT_S))
        assert (hello["type"], hello["role"], hello["rate_hz"]) == ("hello", "viewer", 20.0)
        tick = receive(stream, "snapshot")["tick"]
        keyed.control.tick()
        while receive(stream, "snapshot")["tick"] == tick:
            pass
        keyed.store.journal.record(Event(1.0, "plan.late", "the plan is late"))
        assert receive(stream, "event")["message"] == "the plan is late"


def test_a_browser_says_its_key_as_a_subprotocol(keyed: Server) -> None:
    offered = [Subprotocol("ucs.v1"), Subprotocol(f"bearer.{keyed.keys[Role.OPERATOR]}")]
    with connect(keyed.stream_url, subprotocols=offered, origin=keyed.url, proxy=None) as stream:
        assert stream.subprotocol == "ucs.v1"
        assert receive(stream, "hello")["role"] == "operator"


@pytest.mark.parametrize(
    ("options", "status"),
    [
        ({}, 401),
        ({"subprotocols": [Subprotocol("ucs.v1"), Subprotocol("bearer.wrong")]}, 401),
        ({"origin": "https://evil.example"}, 403),
    ],
)
def test_strangers_and_other_pages_get_no_stream(keyed: Server, options: dict[str, Any], status: int) -> None:
    with pytest.raises(InvalidStatus) as refused, connect(keyed.stream_url, proxy=None, **options):
        pass
    assert refused.value.response.status_code == status


def test_a_client_may_change_its_mind_and_is_told_when_it_makes_no_sense(local: Server) -> None:
    with connect(local.stream_url + "?rate_hz=0.1&topics=events", proxy=None) as stream:
        assert receive(stream, "hello")["topics"] == ["events"]
        stream.send("what?")
        assert "detail" in receive(stream, "problem")
        stream.send(b"\x00\x01")
        receive(stream, "problem")
        stream.send(json.dumps({"type": "subscribe", "rate_hz": 20, "topics": ["snapshot"]}))
        first, second = receive(stream, "snapshot"), receive(stream, "snapshot")
        assert first["vehicles"] == second["vehicles"]


def test_a_client_that_says_too_much_is_closed_and_the_others_go_on(local: Server) -> None:
    with connect(local.stream_url, proxy=None) as quiet, connect(local.stream_url, proxy=None) as loud:
        loud.send("x" * 20_000_000)
        with pytest.raises(ConnectionClosed):
            receive(loud, "no such message")
        assert receive(quiet, "snapshot")


def test_a_client_that_reads_nothing_holds_up_nobody(local: Server) -> None:
    """Its socket is full after a while; the others and REST are served as before."""
    with connect(local.stream_url + "?rate_hz=20", proxy=None, max_queue=1, close_timeout=0.2) as stuck:
        for index in range(1500):
            local.store.tail.append(Event(float(index), "vehicle.text", "x" * 4000))
        with connect(local.stream_url + "?rate_hz=20", proxy=None, close_timeout=0.2) as reading:
            assert receive(reading, "snapshot")
            assert receive(reading, "event")
        with local.client() as client:
            assert client.get("/readyz").status_code == 200
        stuck.socket.shutdown(socket.SHUT_RDWR)


def test_streams_are_counted(local: Server) -> None:
    with connect(local.stream_url, proxy=None) as stream, local.client() as client:
        receive(stream, "hello")
        assert f"{HTTP_METRIC} 1.0" in client.get("/metrics").text


def test_a_message_above_the_limit_closes_the_connection_and_one_below_does_not(local: Server) -> None:
    with connect(local.stream_url, proxy=None) as stream:
        stream.send("x" * (MAX_CLIENT_MESSAGE_BYTES - 100))
        assert receive(stream, "problem")
        stream.send("x" * (MAX_CLIENT_MESSAGE_BYTES + 1))
        with pytest.raises(ConnectionClosed) as closed:
            receive(stream, "no such message")
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1009


def test_a_client_that_talks_without_end_is_closed(local: Server) -> None:
    """Each message wakes its session, so a talkative one would cost the server as much as it likes."""
    with connect(local.stream_url + "?topics=events", proxy=None) as stream:
        try:
            for _ in range(int(4 * stream_route.MESSAGES_PER_S)):
                stream.send(json.dumps({"type": "subscribe", "rate_hz": 1, "topics": ["events"]}))
        except ConnectionClosed:
            pass  # it did not wait for the last one
        with pytest.raises(ConnectionClosed) as closed:
            receive(stream, "no such message")
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008


def test_the_stream_has_so_many_seats_and_they_come_free(server_store: Store, tmp_path: Path) -> None:
    settings = ApiSettings(host="127.0.0.1", one_time_key="k", dashboard=tmp_path / "none", max_streams=2)
    with serving(server_store, settings) as server:
        with connect(server.stream_url, proxy=None) as first, connect(server.stream_url, proxy=None) as second:
            assert receive(first, "hello")
            assert receive(second, "hello")
            with pytest.raises(InvalidStatus) as refused, connect(server.stream_url, proxy=None):
                pass
            assert refused.value.response.status_code == 503
            assert "max_streams" in json.loads(refused.value.response.body or b"{}")["detail"]
        until_s = time.monotonic() + WAIT_S
        while True:
            try:
                with connect(server.stream_url, proxy=None) as again:
                    assert receive(again, "hello")
                break
            except InvalidStatus:  # the server has not heard yet that the others left
                assert time.monotonic() < until_s


def test_a_phone_that_reports_too_often_is_told_and_closed(keyed: Server, operator: httpx.Client) -> None:
    live = operator.post("/api/v1/campaigns", json=LIVE).json()["id"]
    url = keyed.stream_url.replace("/stream", f"/campaigns/{live}/reports")
    fix = {"user": "u1", "lat_deg": 40.4253, "lon_deg": -86.92, "time": 1_700_000_000}
    with connect(url, additional_headers=bearer(keyed, Role.REPORTER), proxy=None) as phone:
        try:
            for number in range(int(4 * MESSAGES_PER_S)):
                phone.send(json.dumps({"type": "fixes", "number": number, "fixes": [fix]}))
        except ConnectionClosed:
            pass
        assert receive(phone, "problem")["status"] == 429
        with pytest.raises(ConnectionClosed) as closed:
            receive(phone, "no such message")
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008
