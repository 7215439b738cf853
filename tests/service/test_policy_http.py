"""The HTTP service: complete requests, problem documents, never a 5xx by input."""

import copy
import json
import signal
import subprocess
import sys
import tomllib
from contextlib import closing
from pathlib import Path

import httpx
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from policy.agents.registry import PolicyChoice
from policy.service import PolicyFaultError, PolicyService, RemotePolicy, RemotePolicyError, StateError
from policy.service.app import ActRequest, Desk
from policy.service.body_limit import MAX_BODY_BYTES
from policy.service.problems import ProblemError
from policy.service.wire import (
    ScenarioWire,
    StateWire,
    plain,
    scenario_document,
    scenario_from,
    state_document,
    state_from,
)


@pytest.fixture(scope="module")
def client(address):
    with httpx.Client(base_url=address, timeout=150.0) as client:  # the first one waits for the compiler
        yield client


def body(scenario, state, /, **more):
    request = {"campaign_id": "c1", "scenario": scenario_document(scenario), "state": state_document(state)}
    return {**request, **more}


def check_problem(response, status):
    assert response.status_code == status
    assert response.headers["content-type"] == "application/problem+json"
    document = response.json()
    assert document["status"] == status
    assert document["title"]
    assert document["detail"]
    return document


def test_the_answer_names_headings_and_speeds(client, scenario, state):
    response = client.post("/v1/act", json=body(scenario, state, policy="receding-horizon"))
    assert response.status_code == 200
    answer = response.json()
    assert (answer["campaign_id"], answer["slot"], answer["policy"]) == ("c1", 0, "receding-horizon")
    assert np.degrees(answer["heading_rad"]) == pytest.approx(answer["heading_deg"])
    assert len(answer["speed_mps"]) == 2
    assert answer["value"] is not None
    assert answer["explanation"]
    assert answer["decision_ms"] > 0.0


def test_the_documented_request_is_answered(client):
    documented = Path("docs/policy-cli.md").read_text().split("```json\n")[1].split("```")[0]
    answer = client.post("/v1/act", json=json.loads(documented))
    assert answer.status_code == 200
    assert len(answer.json()["heading_deg"]) == 2


def test_a_mission_by_name_or_as_a_document(client, state):
    document = tomllib.loads(Path("missions/demo.toml").read_text())
    for mission in ("demo", document):
        request = {"campaign_id": "m", "mission": mission, "policy": "random", "state": state_document(state)}
        if mission is document:
            document["users"]["count"] = 4
            assert client.post("/v1/act", json=request).status_code == 200
        else:
            assert "campaign needs [60" in check_problem(client.post("/v1/act", json=request), 422)["detail"]


def test_scenario_and_state_survive_the_wire(scenario, state):
    there = json.loads(json.dumps(scenario_document(scenario)))
    back = scenario_from(ScenarioWire.model_validate(there))
    assert scenario_document(back) == scenario_document(scenario)
    again = state_from(StateWire.model_validate(json.loads(json.dumps(state_document(state)))))
    assert state_document(again) == state_document(state)
    ideal = scenario.with_accel(float("inf"))
    assert scenario_from(ScenarioWire.model_validate(scenario_document(ideal))).max_accel_mps2 == float("inf")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"policy": "randon"}, 'did you mean "random"'),
        ({"policy": "muzero"}, "comes without a trained network"),
        ({"scenario": None}, "either mission or scenario"),
        ({"mission": "demo"}, "either mission or scenario"),
        ({"scenario": None, "mission": "../demo"}, "there is no '../demo' here"),
        ({"scenario": None, "mission": {"policy": {"name": "gcrl", "checkpoint": "/etc/passwd"}}}, "--checkpoint"),
        ({"scenario": None, "mission": {"campaign": 3}}, "[campaign]"),
        ({"seed": -1}, "seed"),
        ({"surprise": 1}, "#/surprise"),
        ({"campaign_id": ""}, "#/campaign_id"),
    ],
)
def test_what_is_wrong_is_said(client, scenario, state, change, words):
    document = check_problem(client.post("/v1/act", json=body(scenario, state, **change)), 422)
    assert words in document["detail"]


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (("state", "uav_pos_enu_m"), [[0.0, 0.0]], "campaign needs [2, 2]"),
        (("state", "user_aoi_slots", 1), None, "#/state/user_aoi_slots/1"),
        (("state", "slot"), 99, "slots 0 to 7"),
        (("scenario", "radio", "mcl_db"), 60.0, "nobody can be served"),
        (("scenario", "radio", "colour"), 1.0, "#/scenario/radio/colour"),
        (("scenario", "launch_enu_m", 0), [-5.0, 0.0], "outside the area"),
        (("scenario", "battery_j"), 10.0, "empty before the last slot"),
    ],
)
def test_wrong_parts_are_named(client, scenario, state, path, value, words):
    request = body(scenario, state)
    target = request
    for key in path[:-1]:
        target = target[key]
    target[path[-1]] = value
    assert words in check_problem(client.post("/v1/act", json=request), 422)["detail"]


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[]", b"null", b"\xff", b'{"state": NaN}', b"[" * 50_000, b"9" * 5000, b'{"a": "\\ud800"}']
)
def test_json_that_is_none(client, content):
    response = client.post("/v1/act", content=content, headers={"content-type": "application/json"})
    assert 400 <= response.status_code < 500
    check_problem(response, response.status_code)


def test_nan_in_an_array(client, scenario, state):
    text = json.dumps(body(scenario, state)).replace('"user_data_mb": [0.0', '"user_data_mb": [NaN')
    response = client.post("/v1/act", content=text, headers={"content-type": "application/json"})
    assert "#/state/user_data_mb/0" in check_problem(response, 422)["detail"]


def test_too_large_a_body(client):
    check_problem(client.post("/v1/act", content=b" " * (MAX_BODY_BYTES + 1)), 413)


def test_other_paths_and_methods(client):
    check_problem(client.get("/nowhere"), 404)
    check_problem(client.get("/v1/act"), 405)
    assert client.get("/healthz").json() == {"status": "ok"}
    assert "random" in client.get("/v1/policies").json()["policies"]
    assert "/v1/act" in client.get("/openapi.json").json()["paths"]


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**30), 10**30) | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)


def places(document, path=()):
    inner = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    return [path, *(found for key, value in inner for found in places(value, (*path, key)))]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=150, deadline=None)
@given(data=st.data())
def test_no_request_makes_the_service_fail(client, scenario, state, data):
    request = copy.deepcopy(body(scenario, state, policy=data.draw(st.sampled_from(["random", "receding-horizon"]))))
    for _ in range(data.draw(st.integers(1, 2))):
        ways = [way for way in places(request) if way]
        *way, last = data.draw(st.sampled_from(ways))
        target = request
        for key in way:
            target = target[key]
        target[last] = data.draw(VALUES)
    response = client.post("/v1/act", content=json.dumps(request), headers={"content-type": "application/json"})
    assert response.status_code < 500
    if response.status_code != 200:
        check_problem(response, response.status_code)


@settings(max_examples=100, deadline=None)
@given(value=VALUES)
def test_whatever_an_explanation_holds_becomes_json(value):
    json.dumps(plain({"inner": [value, np.float64(1.0), np.array([np.nan, 1.0])]}), allow_nan=False)


@pytest.fixture
def away(address):
    with closing(RemotePolicy(address, timeout_s=60.0)) as policy:
        yield policy


def test_the_remote_policy_decides_like_the_one_in_process(away, scenario, state):
    here = PolicyService()
    for service in (away, here):
        service.begin("c", scenario, PolicyChoice("random"), seed=3)
    theirs, ours = away.act("c", state), here.act("c", state)
    assert np.array_equal(theirs.action.heading_rad, ours.action.heading_rad)
    assert np.array_equal(theirs.action.speed_mps, ours.action.speed_mps)
    away.end("c")
    with pytest.raises(RemotePolicyError, match="has not begun"):
        away.act("c", state)


def test_a_service_that_has_forgotten_takes_the_campaign_up_again(scenario, state):
    desk = Desk(None, PolicyService(max_campaigns=1))
    requests = [ActRequest.model_validate(body(scenario, state, campaign_id=name)) for name in ("a", "b", "a")]
    assert [desk.act(request)["campaign_id"] for request in requests] == ["a", "b", "a"]


def test_a_defect_of_the_policy_is_not_blamed_on_the_request(scenario, state):
    class Broken(PolicyService):
        def act(self, campaign_id, state):
            raise PolicyFaultError("gcrl answered a heading or speed that is not finite in slot 0")

    with pytest.raises(ProblemError) as caught:
        Desk(None, Broken()).act(ActRequest.model_validate(body(scenario, state)))
    assert caught.value.status == 500


def test_the_remote_policy_tells_refusals_apart(away, scenario, state):
    away.begin("c", scenario, PolicyChoice("none"))
    with pytest.raises(RemotePolicyError, match='refused: unknown policy "none"'):
        away.act("c", state)
    with pytest.raises(RemotePolicyError, match="policy serve --checkpoint"):
        away.begin("d", scenario, PolicyChoice("gcrl", checkpoint="x"))
    with pytest.raises(StateError):
        away.act("c", state_from(StateWire.model_validate({**state_document(state), "slot": 50})))
    gone = RemotePolicy("http://127.0.0.1:9", timeout_s=1.0)
    gone.begin("c", scenario, PolicyChoice("random"))
    with pytest.raises(RemotePolicyError, match=r"127\.0\.0\.1:9"):
        gone.act("c", state)
    gone.close()


def test_served_by_its_own_command(scenario, state):
    command = [sys.executable, "-m", "policy", "serve", "--port", "0", "--policy", "random"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            ready = server.stdout.readline()
            url = ready.split()[-1]
            away = RemotePolicy(url, timeout_s=20.0)
            away.begin("c", scenario, PolicyChoice("random"))
            assert away.act("c", state).action.heading_rad.shape == (2,)
            assert httpx.get(f"{url}/healthz").json() == {"status": "ok"}
            away.close()
        finally:
            server.send_signal(signal.SIGINT)
            code = server.wait(timeout=20)
    assert code == 0
