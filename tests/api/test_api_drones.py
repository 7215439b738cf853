"""Drones over REST."""

import httpx
import pytest
from api_server import Server

from gcs.ports import CommandKind

WAIT_S = 10.0


def test_drones_are_shown_with_the_age_of_what_is_known(operator: httpx.Client) -> None:
    first, second = operator.get("/api/v1/drones").json()
    assert (first["system_id"], second["system_id"]) == (1, 2)
    assert first["heartbeat_age_s"] == pytest.approx(0.25)
    assert first["position_age_s"] == pytest.approx(0.1)
    assert first["speed_mps"] == pytest.approx(5.0)
    assert first["heading_deg"] == pytest.approx(53.13, abs=0.01)
    assert first["texts"] == ["Arm: not ready�"]
    assert operator.get("/api/v1/drones/1").json() == first
    assert first["east_m"] is None


def test_metres_are_those_of_the_campaign_in_the_air(operator: httpx.Client, campaign_id: str) -> None:
    operator.post(f"/api/v1/campaigns/{campaign_id}/start")
    drone = operator.get("/api/v1/drones/1").json()
    assert (drone["east_m"], drone["north_m"]) == (pytest.approx(848.7, abs=1.0), pytest.approx(555.2, abs=1.0))


@pytest.mark.parametrize("system_id", ["3", "0", "256", "one", "-1"])
def test_an_unknown_drone(operator: httpx.Client, system_id: str) -> None:
    status = operator.get(f"/api/v1/drones/{system_id}").status_code
    assert status == (404 if system_id == "3" else 422)


def test_the_answer_carries_the_vehicles_own_verdict(keyed: Server, operator: httpx.Client) -> None:
    refused = operator.post("/api/v1/drones/1/commands", json={"command": "arm"})
    assert refused.status_code == 200
    assert refused.json() == {
        "system_id": 1, "command": "arm", "accepted": False, "result": "refused", "reason": "Arm: GPS not ready",
        "attempts": 1, "duration_s": 0.2,
    }  # fmt: skip
    assert operator.post("/api/v1/drones/2/commands", json={"command": "hold"}).json()["accepted"] is True
    assert keyed.store.journal.flush(WAIT_S)
    orders = [(o.system_id, o.command, o.result, o.actor) for o in keyed.store.orders.newest()]
    assert orders == [(2, "hold", "accepted", "operator"), (1, "arm", "refused", "operator")]


def test_an_order_reaches_the_flight_as_it_was_given(keyed: Server, operator: httpx.Client) -> None:
    operator.post("/api/v1/drones/2/commands", json={"command": "takeoff", "altitude_m": 12.5})
    (request,) = keyed.control.requests
    assert request.command is not None
    assert (request.command.kind, request.command.system_id) == (CommandKind.TAKEOFF, 2)
    assert (request.command.altitude_m, request.command.force) == (12.5, False)


def test_an_order_that_the_rules_forbid_is_a_conflict(operator: httpx.Client) -> None:
    answer = operator.post("/api/v1/drones/1/commands", json={"command": "terminate"})
    assert (answer.status_code, answer.json()["detail"]) == (409, "terminate needs force while flying")


@pytest.mark.parametrize(
    "body",
    [
        {"command": "dance"},
        {},
        {"command": "takeoff", "altitude_m": -1},
        {"command": "takeoff", "altitude_m": 1e9},
        {"command": "arm", "speed": 3},
        [],
    ],
)
def test_an_order_that_is_none_reaches_nobody(keyed: Server, operator: httpx.Client, body: object) -> None:
    assert operator.post("/api/v1/drones/1/commands", json=body).status_code == 422
    assert keyed.control.requests == []


def test_the_emergency_stop_latches_until_reset(operator: httpx.Client, keyed: Server) -> None:
    assert operator.post("/api/v1/emergency-stop").status_code == 202
    assert keyed.control.snapshot().stopped
    assert operator.post("/api/v1/emergency-stop/reset").status_code == 202
    assert not keyed.control.snapshot().stopped


def test_one_drone_is_stopped_alone(operator: httpx.Client, keyed: Server) -> None:
    assert operator.post("/api/v1/drones/1/emergency-stop").status_code == 202
    assert operator.post("/api/v1/drones/1/emergency-stop/reset").status_code == 202
    assert [request.system_id for request in keyed.control.requests] == [1, 1]
    assert operator.post("/api/v1/drones/99/emergency-stop").status_code == 404
