"""HTTP control: faults while the mock runs."""

from __future__ import annotations

import json
import re
import socket
import struct
import threading
import time
import urllib.error
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from mock_process import free_port, running
from mock_station import station

from sitl_mock.control import Control, answer


def _ask(url: str, method: str = "GET", body: object = None) -> tuple[int, Any]:
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(url, data, method=method)
    try:
        with urllib.request.urlopen(request, timeout=20) as reply:
            return reply.status, json.load(reply)
    except urllib.error.HTTPError as error:
        with error:
            return error.code, json.load(error)


def test_a_fault_begins_now_and_ends_when_told() -> None:
    ground = station("ardupilot")
    ground.run(3.0)
    made = answer(ground.simulation, "POST", "/faults", b'{"kind": "gps_loss"}')
    assert (made.status, made.body["at_s"]) == (201, pytest.approx(3.0))
    ground.run(0.1)
    assert ground.vehicle.faults.gps_lost
    listed = answer(ground.simulation, "GET", "/faults", b"").body["faults"]
    assert [(fault["kind"], fault["on"]) for fault in listed] == [("gps_loss", True)]
    assert answer(ground.simulation, "DELETE", f"/faults/{made.body['number']}", b"").status == 200
    ground.run(0.1)
    assert not ground.vehicle.faults.gps_lost


@pytest.mark.parametrize(
    ("method", "path", "body", "status"),
    [
        ("POST", "/faults", b"no json", 400),
        ("POST", "/faults", b'{"kind": "meteor"}', 400),
        ("POST", "/faults", b'{"kind": "loss", "value": NaN}', 400),
        ("POST", "/faults", b"[" * 10_000, 400),
        ("DELETE", "/faults/7", b"", 404),
        ("GET", "/", b"", 404),
    ],
)
def test_bad_requests_are_told_what_is_wrong(method: str, path: str, body: bytes, status: int) -> None:
    ground = station("px4")
    reply = answer(ground.simulation, method, path, body)
    assert reply.status == status
    assert reply.body["error"]
    assert ground.simulation.script.faults == {}


def test_over_http_while_the_clock_runs() -> None:
    options = ("--count", "2", "--first-port", str(free_port(2)), "--control", "0")
    with running(*options, count=3) as mock:  # two drones and the control line
        found = re.fullmatch(r"control ready: (http://\S+)", mock.lines[1])
        assert found
        with ThreadPoolExecutor(1) as pool:

            def ask(path: str, method: str = "GET", body: object = None) -> tuple[int, Any]:
                call = pool.submit(_ask, found[1] + path, method, body)
                while not call.done():
                    mock.advance_to(mock.advance_to(0.0) + 0.02)
                return call.result()

            status, made = ask("/faults", "POST", {"kind": "compass_error", "vehicle": 2, "value": 45})
            assert (status, made["kind"]) == (201, "compass_error")
            assert ask("/faults", "POST", {"kind": "cut", "vehicle": 9})[0] == 400
            _, shown = ask("/vehicles")
            assert [vehicle["system"] for vehicle in shown["vehicles"]] == [1, 2]
            assert ask(f"/faults/{made['number']}", "DELETE")[0] == 200


def test_a_client_that_leaves_before_the_answer_is_no_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    ground = station("px4")
    control = Control("127.0.0.1", 0)
    faults: list[object] = []
    over = threading.Event()
    monkeypatch.setattr(control._server, "handle_error", lambda *who: faults.append(who))
    monkeypatch.setattr(control._server, "shutdown_request", lambda request: (request.close(), over.set()))
    client = socket.create_connection(control.address)
    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # a reset, not a farewell
    client.sendall(b"GET /vehicles HTTP/1.0\r\n\r\n")
    while control._calls.empty():
        time.sleep(0.001)
    client.close()
    control.serve(ground.simulation)
    assert over.wait(20.0)
    control.close()
    assert faults == []
