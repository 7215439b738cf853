"""A flood of requests is answered or refused, and the drones' setpoints leave as before."""

import threading
import time
from collections import Counter

import httpx
import pytest
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
        answers: Counter[int] = Counter()
        periods_s = relay.periods_during(lambda: flood(client, answers))
        assert max(periods_s) < PX4_PATIENCE_S
        assert sum(periods_s) > FLOOD_S - 2 * PX4_PATIENCE_S
        assert set(answers) <= {200, 429}  # nothing breaks; who asks too much is told so
        assert answers.total() > CLIENTS


def flood(client: httpx.Client, answers: Counter[int]) -> None:
    """Ask as fast as the server answers, from several threads at once."""

    def ask() -> None:
        ends_s = time.monotonic() + FLOOD_S
        mine: Counter[int] = Counter()
        while time.monotonic() < ends_s:
            mine[client.get("/api/v1/events?limit=1000").status_code] += 1
        answers.update(mine)

    threads = [threading.Thread(target=ask) for _ in range(CLIENTS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
