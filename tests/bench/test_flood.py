"""A flood of requests is answered or refused, and the drones' setpoints leave as before."""

import os
import time
from collections import Counter

import httpx
import pytest
from load import _answer, _busy_s, _clients, _everybody_of_ours_s, _go
from setpoints import start_campaign, watched_flight

FLOOD_S = 6.0
CLIENTS = 8
PX4_PATIENCE_S = 0.5  # COM_OF_LOSS_T of a cautious fleet; PX4 wants setpoints at 2 Hz
STREAM_TIMEOUT_S = 120.0


@pytest.mark.flight
def test_a_flooded_server_keeps_the_stream() -> None:
    with watched_flight() as (relay, client):
        start_campaign(client)
        deadline_s = time.monotonic() + STREAM_TIMEOUT_S
        while not relay.stamps[0]:
            assert time.monotonic() < deadline_s, "no setpoint left the server"
            time.sleep(0.1)
        key = client.headers["authorization"].removeprefix("Bearer ")
        # In a process of its own: beside its threads the relay would note late what had come in time.
        with _clients("flood", str(client.base_url).rstrip("/"), key, str(FLOOD_S), str(CLIENTS)) as flood:
            busy_s, ours_s = _busy_s(), _everybody_of_ours_s()
            answers: Counter[str] = Counter()
            periods_s = relay.periods_during(lambda: (_go(flood), answers.update(_answer(flood))))
        others = (_busy_s() - busy_s - (_everybody_of_ours_s() - ours_s)) / FLOOD_S
        why = account(client, periods_s, answers, others)
        assert periods_s, why
        assert max(periods_s) < PX4_PATIENCE_S, why
        assert sum(periods_s) > FLOOD_S - 2 * PX4_PATIENCE_S, why
        assert set(answers) <= {"200", "429"}, why  # nothing breaks; who asks too much is told so
        assert answers.total() > CLIENTS, why


def account(client: httpx.Client, periods_s: list[float], answers: Counter[str], others: float) -> str:
    """What there is to know of a flood that was not borne: the wire, the server's own words, the machine."""
    worst = sorted(enumerate(periods_s), key=lambda one: -one[1])[:5]
    asked = ("/api/v1/events?newest=true&limit=20&severity=caution", "/api/v1/drones", "/api/v1/campaigns", "/readyz")
    told = "; ".join(f"{path}: {_read(client, path)}" for path in asked)
    return (
        f"{len(periods_s)} periods, together {sum(periods_s):.2f} s; the longest (number, seconds): {worst}; answers "
        f"{dict(answers)}; other programs took {others:.2f} of {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; "
        f"{told}"
    )


def _read(client: httpx.Client, path: str) -> str:
    """The server's own words; after a flood it may refuse some more for a moment."""
    until_s = time.monotonic() + 5.0
    try:
        while (answer := client.get(path)).status_code == 429 and time.monotonic() < until_s:
            time.sleep(0.05)
    except httpx.HTTPError as error:
        return repr(error)
    return answer.text
