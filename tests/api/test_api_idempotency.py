"""The same request twice under one key acts once; too many requests are refused."""

import threading
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest
from api_server import SMALL, Server
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy.exc import OperationalError

from gcs.api.rate_limit import Buckets
from gcs.store.answers import Answers


def keyed_post(client: httpx.Client, path: str, key: str, body: object = None) -> httpx.Response:
    return client.post(path, json=body, headers={"idempotency-key": key})


def test_a_repeated_request_gets_the_first_answer_and_acts_once(operator: httpx.Client, keyed: Server) -> None:
    first = keyed_post(operator, "/api/v1/campaigns", "k1", SMALL)
    again = keyed_post(operator, "/api/v1/campaigns", "k1", SMALL)
    assert (first.status_code, again.status_code, again.json()) == (201, 201, first.json())
    assert again.headers["idempotency-replayed"] == "true"
    assert len(operator.get("/api/v1/campaigns").json()) == 1
    path = f"/api/v1/campaigns/{first.json()['id']}/start"
    assert [keyed_post(operator, path, "k2").status_code for _ in range(3)] == [202, 202, 202]
    assert len([r for r in keyed.control.requests if r.kind == "start"]) == 1


def test_a_refusal_is_repeated_too_and_a_key_belongs_to_one_request(operator: httpx.Client) -> None:
    assert keyed_post(operator, "/api/v1/campaigns", "k", {"mission": "none"}).status_code == 422
    assert keyed_post(operator, "/api/v1/campaigns", "k", {"mission": "none"}).headers["idempotency-replayed"] == "true"
    other = keyed_post(operator, "/api/v1/campaigns", "k", SMALL)
    assert (other.status_code, "another request" in other.json()["detail"]) == (422, True)
    assert keyed_post(operator, "/api/v1/campaigns", "x" * 200, SMALL).status_code == 422


def test_a_request_that_a_killed_server_left_open_is_not_done_again(operator: httpx.Client, keyed: Server) -> None:
    drone = ("/api/v1/drones/1/commands", {"command": "takeoff", "altitude_m": 20})
    assert keyed_post(operator, drone[0], "t", drone[1]).status_code == 200
    with keyed.store.engine.begin() as connection:
        connection.exec_driver_sql("UPDATE answers SET status = NULL, body = NULL")
    given_before = len(keyed.control.requests)
    again = keyed_post(operator, drone[0], "t", drone[1])
    assert (again.status_code, "/api/v1/events" in again.json()["detail"]) == (409, True)
    assert len(keyed.control.requests) == given_before


def test_an_answer_leaves_after_it_is_kept(
    operator: httpx.Client, keyed: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a server killed in between would have answered, and would know nothing of it when asked again."""
    reached, may_go_on, keep = threading.Event(), threading.Event(), Answers.settle

    def slow(self: Answers, actor: str, key: str, status: int, body: str) -> None:
        reached.set()
        assert may_go_on.wait(10.0)
        keep(self, actor, key, status, body)

    monkeypatch.setattr(Answers, "settle", slow)
    with ThreadPoolExecutor(1) as pool:
        asked = pool.submit(keyed_post, operator, "/api/v1/campaigns", "k", SMALL)
        assert reached.wait(10.0)
        with pytest.raises(TimeoutError):
            asked.result(0.2)
        may_go_on.set()
        assert asked.result(10.0).status_code == 201


def test_an_answer_that_cannot_be_kept_is_given_all_the_same(
    operator: httpx.Client, keyed: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    def away(*_: object) -> None:
        raise OperationalError("UPDATE", {}, Exception("the disk is full"))

    monkeypatch.setattr(Answers, "settle", away)
    assert keyed_post(operator, "/api/v1/emergency-stop", "k").status_code == 202
    assert keyed_post(operator, "/api/v1/emergency-stop", "k").status_code == 409, "never done twice"
    assert len(keyed.control.requests) == 1


@given(st.lists(st.floats(0.0, 0.5), max_size=60), st.integers(1, 20), st.integers(1, 20))
def test_never_more_than_the_burst_and_the_rate(gaps_s: list[float], per_s: int, burst: int) -> None:
    buckets, now_s, passed = Buckets(per_s, burst), 0.0, 0
    for gap_s in gaps_s:
        now_s += gap_s
        wait_s = buckets.take("a", now_s)
        passed += wait_s == 0.0
        assert passed <= burst + per_s * now_s + 1e-6
        assert 0.0 <= wait_s <= 1.0 / per_s + 1e-9
    assert buckets.take("b", now_s) == 0.0
