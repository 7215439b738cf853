"""Clients of the load bench, in a process of their own.

``pages BASE KEY SECONDS SYSID``, ``ask BASE KEY SECONDS RATE`` or ``flood BASE KEY SECONDS CLIENTS``.
Says "ready" when it has loaded, begins at the first line that it is told, and answers with one line of JSON.
"""

import json
import sys
import threading
import time
from collections import Counter
from http.client import HTTPConnection, HTTPException
from typing import Any

from websockets.sync.client import connect

PAGES = 20
PAGE_HZ = 5.0  # as gcs/dashboard/src/core/stream.ts
CONNECTIONS = 16
PATHS = ("/api/v1/drones", "/api/v1/campaigns", "/healthz", "/api/v1/events?limit=20")
Place = tuple[float, float, float]  # when it came, latitude, longitude


def pages(base: str, key: str, duration_s: float, system_id: int) -> dict[str, Any]:
    """Clients that take what a page takes; one of them also looks at where a drone is."""
    counts, positions = [0] * PAGES, []
    until_s = time.perf_counter() + duration_s
    wish = {"type": "subscribe", "rate_hz": PAGE_HZ, "topics": ["snapshot", "events"], "deltas": True}

    def follow(index: int) -> None:
        url, here = base.replace("http", "ws") + "/api/v1/stream", {}
        with connect(url, additional_headers={"authorization": f"Bearer {key}"}, proxy=None, max_size=None) as stream:
            stream.send(json.dumps(wish))
            while time.perf_counter() < until_s:
                text = stream.recv(30.0)
                at_s = time.perf_counter()
                counts[index] += '"snapshot"' in text[:40] or '"delta"' in text[:40]
                if index == 0:
                    here = place(json.loads(text), here, at_s, system_id, positions)

    _all_at_once(follow, PAGES)
    return {"snapshots": sum(counts), "pages": PAGES, "positions": positions}


def place(
    message: dict[str, Any], here: dict[str, float], at_s: float, system_id: int, positions: list[Place]
) -> dict[str, float]:
    """Where the drone is after this message; noted with when it came."""
    if message["type"] not in {"snapshot", "delta"}:
        return here
    found = [one for one in message["vehicles"] if one["system_id"] == system_id]
    if not found:
        return here
    now = here | {name: found[0][name] for name in ("lat_deg", "lon_deg") if name in found[0]}
    if now != here:
        positions.append((at_s, now["lat_deg"], now["lon_deg"]))
    return now


def ask(base: str, key: str, duration_s: float, per_s: float) -> dict[str, Any]:
    """An even rate over sixteen connections; a late request is sent at once, none is skipped."""
    latencies_s: list[float] = []
    failed: list[int] = []
    begun_s = time.perf_counter()

    def worker(offset: int) -> None:
        connection = HTTPConnection(base.removeprefix("http://"), timeout=30.0)
        for number in range(int(duration_s * per_s / CONNECTIONS)):
            due_s = begun_s + (number * CONNECTIONS + offset) / per_s
            time.sleep(max(0.0, due_s - time.perf_counter()))
            if time.perf_counter() - begun_s > duration_s:
                return
            sent_s = time.perf_counter()
            path = PATHS[(number + offset) % len(PATHS)]
            connection.request("GET", path, headers={"Authorization": f"Bearer {key}"})
            got = connection.getresponse()
            got.read()
            if got.status == 200:
                latencies_s.append(time.perf_counter() - sent_s)
            else:
                failed.append(got.status)

    _all_at_once(worker, CONNECTIONS)
    return {"latencies_s": latencies_s, "failed": len(failed)}


def flood(base: str, key: str, duration_s: float, clients: int) -> dict[str, int]:
    """As fast as the server answers, from several at once: how often each status came; a failure under its own name."""
    answers: Counter[str] = Counter()

    def worker(_index: int) -> None:
        mine: Counter[str] = Counter()
        ends_s = time.perf_counter() + duration_s
        while time.perf_counter() < ends_s:
            connection = HTTPConnection(base.removeprefix("http://"), timeout=30.0)
            try:
                while time.perf_counter() < ends_s:
                    connection.request("GET", "/api/v1/events?limit=1000", headers={"Authorization": f"Bearer {key}"})
                    got = connection.getresponse()
                    got.read()
                    mine[str(got.status)] += 1
            except (HTTPException, OSError) as error:
                mine[repr(error)] += 1
            finally:
                connection.close()
        answers.update(mine)

    _all_at_once(worker, clients)
    return dict(answers)


def _all_at_once(work: Any, count: int) -> None:
    threads = [threading.Thread(target=work, args=(index,)) for index in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def main() -> None:
    """See the head of this file."""
    kind, base, key, seconds, number = sys.argv[1:]
    print("ready", flush=True)
    sys.stdin.readline()
    answer: dict[str, Any]
    if kind == "pages":
        answer = pages(base, key, float(seconds), int(number))
    elif kind == "ask":
        answer = ask(base, key, float(seconds), float(number))
    else:
        answer = flood(base, key, float(seconds), int(number))
    print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
