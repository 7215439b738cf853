"""Rubbish at every operation of the OpenAPI document: no 5xx, and without a key nothing changes."""

import json
from typing import Any
from urllib.parse import quote

import httpx
from api_server import LIVE, SMALL, Server
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from gcs.store.keys import Role
from gcs.store.reading import EventFilter

EXAMPLES = 150
LEAVES = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(st.characters(), max_size=12)
    | st.sampled_from(["demo", "arm", "2026-05-01T10:00:00Z", "u1", 40.42, -86.92, 2**63, -(2**63), 1e308])
)
NAMES = st.sampled_from(
    ["mission", "policy", "command", "altitude_m", "force", "user", "lat_deg", "lon_deg", "time", "campaign", "area"]
) | st.text(st.characters(), max_size=6)
VALUES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(NAMES, inner, max_size=5), max_leaves=12
)
FIX = {"user": "u1", "lat_deg": 40.4253, "lon_deg": -86.92, "time": 1_700_000_000}
GOOD: list[Any] = [SMALL, LIVE, {"mission": "demo"}, {"command": "hold"}, [FIX], {"name": "x", "role": "viewer"}]
QUERY = st.dictionaries(
    st.sampled_from(["limit", "offset", "severity", "since", "after_id", "kind", "format", "campaign_id", "newest"]),
    st.text(st.characters(codec="utf-8"), max_size=8) | st.integers().map(str) | st.just("2026-05-01T10:00:00Z"),
    max_size=3,
)
QUICK = settings(
    max_examples=EXAMPLES,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@st.composite
def spoiled(draw: st.DrawFn) -> Any:
    """A good document with one value replaced, somewhere."""
    document = json.loads(json.dumps(draw(st.sampled_from(GOOD))))
    place = document
    while isinstance(place, dict | list) and place:
        key = draw(st.sampled_from(sorted(place) if isinstance(place, dict) else range(len(place))))
        if draw(st.booleans()) or not isinstance(place[key], dict | list):
            place[key] = draw(VALUES)
            break
        place = place[key]
    return document


BODIES = (VALUES | spoiled() | st.sampled_from(GOOD)).map(lambda value: json.dumps(value).encode()) | st.binary(
    max_size=40
)
PLACES = st.sampled_from(["known", "live", "none", "1", "2", "255", "0", "-1", "deadbeef"]) | st.text(
    st.characters(codec="utf-8", exclude_characters="/?#%."), min_size=1, max_size=8
)


def operations(server: Server) -> list[tuple[str, str]]:
    with server.client() as client:
        paths = client.get("/openapi.json").json()["paths"]
    return [(method.upper(), path) for path, item in paths.items() for method in item]


def filled(path: str, place: str, known: dict[str, str]) -> str:
    name = quote(known.get(place, place), safe="")
    return "/".join(name if part.startswith("{") else part for part in path.split("/"))


def test_no_rubbish_makes_the_server_fail(keyed: Server, operator: httpx.Client) -> None:
    known = {
        "known": operator.post("/api/v1/campaigns", json=SMALL).json()["id"],
        "live": operator.post("/api/v1/campaigns", json=LIVE).json()["id"],
    }
    everything = operations(keyed)
    assert len(everything) >= 20

    @given(st.sampled_from(everything), PLACES, QUERY, BODIES)
    @QUICK
    def throw(operation: tuple[str, str], place: str, query: dict[str, str], body: bytes) -> None:
        method, path = operation
        headers = {"content-type": "application/json"}
        content = body if method == "POST" else None
        url = filled(path, place, known)
        answer = admin.request(method, url, params=query, content=content, headers=headers)
        assert answer.status_code < 500, (method, url, query, body, answer.text)
        if answer.status_code >= 400:
            assert answer.headers["content-type"] == "application/problem+json"
            assert answer.json()["status"] == answer.status_code

    with keyed.client(Role.ADMIN) as admin:
        throw()
    assert keyed.store.journal.flush(10.0)
    assert keyed.store.journal.health().lost == 0


def test_without_a_key_nothing_changes(keyed: Server) -> None:
    changing = [(method, path) for method, path in operations(keyed) if method != "GET"]

    @given(st.sampled_from(changing), PLACES, BODIES)
    @settings(QUICK, max_examples=60)
    def throw(operation: tuple[str, str], place: str, body: bytes) -> None:
        method, path = operation
        answer = stranger.request(method, filled(path, place, {}), content=body)
        assert answer.status_code == 401

    with keyed.client() as stranger:
        throw()
    assert keyed.control.requests == []
    assert keyed.store.campaigns.newest() == []
    assert len(keyed.store.keys.all()) == len(Role)
    assert keyed.store.journal.flush(10.0)
    assert {event.kind for event in keyed.store.events.find(EventFilter())} == {"api.refused"}
