"""How regularly setpoints leave, seen on the wire: a UDP relay between server and mock stamps each one.

The server flies the demo mission in real time while this process asks the API 200 times a second.
"""

import re
import selectors
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import httpx
from measures import percentile, summary

from policy.mission_file import load_mission

ROOT = Path(__file__).parents[2]
DRONES = 2
REQUESTS_PER_S = 200
SETPOINT_ID = 86  # SET_POSITION_TARGET_GLOBAL_INT
FLYING_TIMEOUT_S = 240.0


def setpoint_periods(quick: bool) -> list[tuple[str, str, str]]:
    """Periods of one drone's setpoints, without and with load."""
    measure_s = 10.0 if quick else 30.0
    with watched_flight() as (relay, client):
        _wait_until_flying(client, start_campaign(client))
        calm = relay.periods_during(lambda: _wait(measure_s))
        latencies_s: list[float] = []
        loaded = relay.periods_during(lambda: _load(client, measure_s, latencies_s))
    return [
        ("period without load", summary(calm, 1e3), "ms"),
        ("period without load, 99th percentile", f"{1e3 * percentile(calm, 0.99):.1f}", "ms"),
        (f"period under load ({len(latencies_s) / measure_s:.0f} requests/s reached)", summary(loaded, 1e3), "ms"),
        ("period under load, 99th percentile", f"{1e3 * percentile(loaded, 0.99):.1f}", "ms"),
        ("request under load, 99th percentile", f"{1e3 * percentile(latencies_s, 0.99):.1f}", "ms"),
    ]


@contextmanager
def watched_flight() -> Iterator[tuple["Relay", httpx.Client]]:
    """Mock drones, a server that hears them through the relay, and an operator's client."""
    with ExitStack() as stack:
        relay = stack.enter_context(Relay(_start_mock(stack)))
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        base, key, _ = _start_server(stack, relay.addresses, f"sqlite:///{folder}/bench.db")
        headers = {"Authorization": f"Bearer {key}"}
        yield relay, stack.enter_context(httpx.Client(base_url=base, headers=headers, timeout=10))


@dataclass
class Relay:
    """Passes datagrams both ways and notes when each drone's setpoints came by."""

    targets: list[int]
    stamps: dict[int, list[float]] = field(default_factory=lambda: defaultdict(list))

    def __enter__(self) -> "Relay":
        self._selector, self._open = selectors.DefaultSelector(), True
        self._fronts = [_bound() for _ in self.targets]
        self.addresses = [front.getsockname()[1] for front in self._fronts]
        for index, (front, target) in enumerate(zip(self._fronts, self.targets, strict=True)):
            back = _bound()
            back.connect(("127.0.0.1", target))
            self._selector.register(front, selectors.EVENT_READ, (index, back, True))
            self._selector.register(back, selectors.EVENT_READ, (index, front, False))
        self._peers: dict[int, tuple[str, int]] = {}
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._open = False
        self._thread.join()
        for key in list(self._selector.get_map().values()):
            key.fileobj.close()  # type: ignore[union-attr]
        self._selector.close()

    def periods_during(self, work: object) -> list[float]:
        """Periods of the first drone's setpoints while ``work()`` runs."""
        begun_s = time.perf_counter()
        work()  # type: ignore[operator]
        stamps = [stamp for stamp in self.stamps[0] if stamp >= begun_s]
        return [later - earlier for earlier, later in pairwise(stamps)]

    def note(self, index: int, data: bytes, *, from_server: bool) -> None:
        """One datagram goes by."""
        if from_server and len(data) > 10 and data[0] == 0xFD and int.from_bytes(data[7:10], "little") == SETPOINT_ID:
            self.stamps[index].append(time.perf_counter())

    def _run(self) -> None:
        while self._open:
            for key, _ in self._selector.select(0.2):
                index, other, from_server = key.data
                try:
                    data, peer = key.fileobj.recvfrom(4096)  # type: ignore[union-attr]
                except ConnectionRefusedError:
                    continue
                self.note(index, data, from_server=from_server)
                if from_server:
                    self._peers[index] = peer
                    other.send(data)
                elif index in self._peers:
                    other.sendto(data, self._peers[index])


def _bound() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 0))
    return made


def _start_mock(stack: ExitStack) -> list[int]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        first = probe.getsockname()[1]
    home = _launch_home()
    command = [sys.executable, "-m", "sitl_mock", "--count", str(DRONES), "--first-port", str(first), "--home", home]
    process = stack.enter_context(subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True))
    stack.callback(process.terminate)
    assert process.stdout is not None
    for _ in range(DRONES):
        process.stdout.readline()
    return [first + index for index in range(DRONES)]


def _launch_home() -> str:
    scenario = load_mission("demo").scenario
    lat, lon = scenario.area.frame.to_geodetic_deg(*(float(v) for v in scenario.launch_enu_m[0]))
    return f"{lat:.7f},{lon:.7f},100"


def _start_server(stack: ExitStack, ports: list[int], store: str) -> tuple[str, str, int]:
    """Its address, operator key and process id."""
    command = [sys.executable, "-m", "gcs", "serve", "--port", "0", "--store", store]
    for index, port in enumerate(ports):
        command += ["--drone", f"{index + 1}=udpout:127.0.0.1:{port}"]
    pipe = subprocess.PIPE
    process = stack.enter_context(subprocess.Popen(command, cwd=ROOT, stdout=pipe, text=True, start_new_session=True))
    stack.callback(process.terminate)
    base = key = ""
    assert process.stdout is not None
    while not (base and key):
        line = process.stdout.readline()
        if not line:
            raise RuntimeError("the server ended before it was ready")
        base = found[1] if (found := re.search(r"(http://\S+?)/?\s*$", line)) else base
        key = found[1] if (found := re.search(r"operator key.*: (\S+)", line)) else key
    threading.Thread(target=process.stdout.read, daemon=True).start()
    return base, key, process.pid


def start_campaign(client: httpx.Client) -> str:
    """Create the demo campaign and order its start, again and again until the drones are ready for it; its number."""
    made = client.post("/api/v1/campaigns", json={"mission": "demo", "policy": "receding-horizon"}).raise_for_status()
    campaign = str(made.json()["id"])
    deadline_s = time.monotonic() + FLYING_TIMEOUT_S
    while client.get(f"/api/v1/campaigns/{campaign}").json()["state"] in {"draft", "ready"}:
        if time.monotonic() > deadline_s:
            raise RuntimeError(f"the campaign did not start within {FLYING_TIMEOUT_S:.0f} s")
        client.post(f"/api/v1/campaigns/{campaign}/start")
        time.sleep(0.5)
    return campaign


def _wait_until_flying(client: httpx.Client, campaign: str) -> None:
    deadline_s = time.monotonic() + FLYING_TIMEOUT_S
    while (state := client.get(f"/api/v1/campaigns/{campaign}").json()["state"]) != "flying":
        if state != "launching" or time.monotonic() > deadline_s:
            raise RuntimeError(f"the campaign is {state}, not flying")
        time.sleep(0.5)


def _wait(duration_s: float) -> None:
    time.sleep(duration_s)


def _load(client: httpx.Client, duration_s: float, latencies_s: list[float]) -> None:
    """An even request rate over sixteen threads; a late request is sent at once, none is skipped."""
    threads = 16
    paths = ("/api/v1/drones", "/api/v1/campaigns", "/healthz", "/api/v1/events?limit=20")

    def worker(offset: int) -> None:
        begun_s = time.perf_counter()
        for number in range(int(duration_s * REQUESTS_PER_S / threads)):
            due_s = begun_s + (number * threads + offset) / REQUESTS_PER_S
            time.sleep(max(0.0, due_s - time.perf_counter()))
            if time.perf_counter() - begun_s > duration_s:
                return
            sent_s = time.perf_counter()
            client.get(paths[number % len(paths)]).raise_for_status()
            latencies_s.append(time.perf_counter() - sent_s)

    workers = [threading.Thread(target=worker, args=(offset,)) for offset in range(threads)]
    for each in workers:
        each.start()
    for each in workers:
        each.join()
