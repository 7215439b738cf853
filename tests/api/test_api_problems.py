"""Every refusal is a problem document (RFC 9457)."""

import httpx
import pytest
from api_server import Server

from gcs.store.keys import Role


def problem(answer: httpx.Response, status: int) -> dict[str, object]:
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    document: dict[str, object] = answer.json()
    assert {"type", "title", "status", "detail", "instance"} <= set(document)
    assert document["status"] == status
    return document


def test_nothing_there_and_not_possible_here(operator: httpx.Client) -> None:
    problem(operator.get("/api/v1/nothing"), 404)
    problem(operator.get("/nothing/at/all"), 404)
    answer = operator.delete("/api/v1/campaigns")
    problem(answer, 405)
    assert "POST" in answer.headers["allow"] or "GET" in answer.headers["allow"]


@pytest.mark.parametrize(
    "body",
    [b"", b"{", b"nul", b"\xff\xfe", b'{"command": NaN}', b'{"command": "\\ud800"}', b"[" * 50_000, b"1" * 9_000],
)
def test_a_body_that_is_no_json_or_no_order(operator: httpx.Client, body: bytes) -> None:
    headers = {"content-type": "application/json"}
    for path in ("/api/v1/campaigns", "/api/v1/drones/1/commands"):
        answer = operator.post(path, content=body, headers=headers)
        assert answer.status_code in {400, 422}
        problem(answer, answer.status_code)


def test_a_wrong_member_is_pointed_at(operator: httpx.Client) -> None:
    document = problem(operator.post("/api/v1/drones/1/commands", json={"command": "dance"}), 422)
    assert str(document["detail"]).startswith("/command: ")
    assert document["errors"] == [{"where": "/command", "detail": str(document["detail"]).partition(": ")[2]}]


def test_a_body_that_is_too_large_announced_or_not(operator: httpx.Client, keyed: Server) -> None:
    large = b" " * (keyed.settings.max_body_bytes + 1)
    problem(operator.post("/api/v1/campaigns", content=large, headers={"content-type": "application/json"}), 413)
    chunks = (large[i : i + 50_000] for i in range(0, len(large), 50_000))
    problem(operator.post("/api/v1/campaigns", content=chunks, headers={"content-type": "application/json"}), 413)


def test_strangers_are_refused_before_their_body_is_read(keyed: Server) -> None:
    with keyed.client() as stranger:
        problem(stranger.post("/api/v1/campaigns", content=b"{"), 401)


def test_an_endless_query(operator: httpx.Client) -> None:
    problem(operator.get("/api/v1/events", params={"kind": "x" * 9_000}), 414)


def test_safe_headers_are_on_every_answer(keyed: Server) -> None:
    with keyed.client(Role.VIEWER) as viewer:
        for path in ("/", "/api/v1/drones", "/nothing", "/docs"):
            headers = viewer.get(path).headers
            assert headers["x-content-type-options"] == "nosniff"
            assert "frame-ancestors 'none'" in headers["content-security-policy"]
        assert viewer.get("/api/v1/drones").headers["cache-control"] == "no-store"
