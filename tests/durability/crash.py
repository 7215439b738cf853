"""A real server killed with -9 while real mock drones fly for it, again and again; also a program of its own.

python tests/durability/crash.py --kills 50
"""

import argparse
import random
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from gcs.cli.mock_fleet import free_udp_ports
from gcs.store.chain import ChainReport, verify_chain
from gcs.store.reading import EventFilter
from gcs.store.records import EventRecord
from gcs.store.store import using_store

ROOT = Path(__file__).parents[2]
FINAL = {"done", "aborted", "failed"}
HOME = "40.4258,-86.9197,186"
POLL_S = 0.05


def mission(slots: int) -> dict[str, Any]:
    """Two drones, low and close, so that a flight is short."""
    return {
        "campaign": {"name": "crash", "slots": slots, "slot_s": 15.0},
        "area": {"south_west": [40.4203, -86.93], "size_m": [1667.0, 1222.0]},
        "fleet": {"uavs": 2, "altitude_m": 45.0, "max_speed_mps": 15.0, "launch_m": [873.0, 611.0]},
        "users": {"source": "walkers", "count": 8},
        "policy": {"name": "random"},
    }


@dataclass
class Server:
    """One process; ``up_s``: from its birth to its address."""

    process: subprocess.Popen[str]
    client: httpx.Client
    up_s: float
    opened_s: float

    def get(self, path: str) -> Any:
        """JSON of a GET."""
        return self.client.get(path).raise_for_status().json()


@dataclass
class CrashLog:
    """What was seen of one campaign."""

    killed_in: list[str] = field(default_factory=list)
    up_s: list[float] = field(default_factory=list)
    resumed_s: list[float] = field(default_factory=list)  # from the address printed to the drones obeying again
    seen_slots: list[int] = field(default_factory=list)  # the newest slot told over REST before each kill
    kept_slots: list[int] = field(default_factory=list)  # the newest slot in the store after it
    state: str = ""
    reason: str = ""
    slots: list[int] = field(default_factory=list)
    still_armed: list[int] = field(default_factory=list)
    events: list[EventRecord] = field(default_factory=list)
    chain: ChainReport | None = None

    def given(self, kind: str) -> set[int | None]:
        """To whom an order of this kind was given."""
        return {e.system_id for e in self.events if e.kind == "command.given" and e.data["command"] == kind}

    def orders(self, kind: str) -> list[int | None]:
        """To whom an order of this kind was given and accepted."""
        verdicts = [event for event in self.events if event.kind == "command.verdict"]
        return [e.system_id for e in verdicts if (e.data["command"], e.data["result"]) == (kind, "accepted")]


@contextmanager
def mock_drones(speedup: float, flavour: str) -> Iterator[int]:
    """Two mock drones on their own clock; the first port."""
    port = free_udp_ports(2)
    words = ["--count", "2", "--flavour", flavour, "--first-port", str(port), "--speedup", str(speedup)]
    command = [sys.executable, "-m", "sitl_mock", *words, "--home", HOME, "--ready-after-s", "2"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for _ in range(2):
            assert "ready" in process.stdout.readline()
        try:
            yield port
        finally:
            process.terminate()


def start_server(store: str, port: int, speedup: float) -> Server:
    """Wait for its address and key."""
    begun_s = time.monotonic()
    drones = [f"--drone={i + 1}=udpout:127.0.0.1:{port + i}" for i in range(2)]
    command = [
        sys.executable,
        "-m",
        "gcs",
        "serve",
        "--port",
        "0",
        "--store",
        store,
        "--speedup",
        str(speedup),
        *drones,
    ]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    address = re.search(r"open (\S+)/", process.stdout.readline())
    assert address, "the server did not start"
    opened_s = time.monotonic()
    key = process.stdout.readline().strip().rpartition(" ")[2]
    headers = {"authorization": f"Bearer {key}"}
    client = httpx.Client(base_url=address[1] + "/api/v1", headers=headers, timeout=20.0, trust_env=False)
    return Server(process, client, opened_s - begun_s, opened_s)


def end(server: Server) -> None:
    """SIGKILL: nothing is put away."""
    server.process.kill()
    server.process.communicate()
    server.client.close()


def crash(
    folder: Path, kill_after_s: list[float], *, speedup: float, slots: int, flavour: str = "px4", limit_s: float = 150.0
) -> CrashLog:
    """Fly a campaign; kill the server so many seconds after it (or its successor) was up."""
    store, log = f"sqlite:///{folder / 'crash.db'}", CrashLog()
    until_s = time.monotonic() + limit_s
    with mock_drones(speedup, flavour) as port:
        server = start_server(store, port, speedup)
        try:
            made = server.client.post("/campaigns", json=mission(slots)).raise_for_status().json()["id"]
            _wait_for_drones(server, until_s)
            server.client.post(f"/campaigns/{made}/start").raise_for_status()
            for after_s in kill_after_s:
                seen = _watch(server, made, log, time.monotonic() + after_s)
                if seen["state"] in FINAL:
                    break
                end(server)
                log.killed_in.append(seen["state"])
                log.seen_slots.append(seen["slot"])
                with using_store(store) as kept:
                    log.kept_slots.append(kept.slots.progress(made)[0])
                server = start_server(store, port, speedup)
                log.up_s.append(server.up_s)
                _wait_resumed(server, made, log)
            seen = _watch(server, made, log, until_s)
            log.state, log.reason = seen["state"], seen["reason"]
            log.still_armed = [drone["system_id"] for drone in server.get("/drones") if drone["armed"]]
        finally:
            end(server)
    with using_store(store) as kept:
        log.slots = [record.slot for record in kept.slots.of(made)]
        log.events = list(kept.events.find(EventFilter(), 100_000))
        log.chain = verify_chain(kept.engine)
    return log


def _wait_for_drones(server: Server, until_s: float) -> None:
    while len([d for d in server.get("/drones") if d["position_ready"]]) < 2 and time.monotonic() < until_s:
        time.sleep(POLL_S)


def _watch(server: Server, campaign: str, log: CrashLog, until_s: float) -> dict[str, Any]:
    """Until the campaign is over or the time is up: the newest that was told."""
    while True:
        seen: dict[str, Any] = server.get(f"/campaigns/{campaign}")
        if seen["state"] in FINAL or time.monotonic() >= until_s:
            return seen
        time.sleep(min(POLL_S, max(0.0, until_s - time.monotonic())))


def _wait_resumed(server: Server, campaign: str, log: CrashLog) -> None:
    """Every drone that is up in a campaign that flies obeys again."""
    while time.monotonic() < server.opened_s + 10.0:
        seen = server.get(f"/campaigns/{campaign}")
        told = server.get(f"/events?campaign_id={campaign}&kind=campaign.resumed&limit=1000")
        obeying = all(d["mode"] == "guided" for d in server.get("/drones"))
        if len(_items(told)) >= len(log.killed_in) and (obeying or seen["state"] != "flying"):
            log.resumed_s.append(time.monotonic() - server.opened_s)
            return
        time.sleep(POLL_S)
    log.resumed_s.append(float("inf"))


def _items(page: Any) -> list[Any]:
    return page if isinstance(page, list) else next(value for value in page.values() if isinstance(value, list))


def main() -> int:
    """Campaigns with random kills until there are enough; a table of what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--speedup", type=float, default=5.0)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    draw, done, good = random.Random(args.seed), 0, 0
    while done < args.kills:
        moments = [draw.uniform(0.2, 15.0) for _ in range(4)]
        with tempfile.TemporaryDirectory() as folder:
            flavour = draw.choice(["px4", "ardupilot"])
            log = crash(Path(folder), moments, speedup=args.speedup, slots=16, flavour=flavour, limit_s=300.0)
        whole = log.slots == list(range(17)) and log.chain is not None and log.chain.broken_id is None
        kept = all(kept >= seen for seen, kept in zip(log.seen_slots, log.kept_slots, strict=True))
        ended = log.state == "done" and not log.still_armed
        done += len(log.killed_in)
        good += len(log.killed_in) * (whole and kept and ended)
        times = " ".join(f"{value:.1f}" for value in log.resumed_s)
        print(f"{flavour}: killed while {', '.join(log.killed_in)}; obeying after {times} s; {log.state} {log.reason}")
        print(f"  records whole {whole}, nothing told was lost {kept}, armed in the end: {log.still_armed}", flush=True)
    print(f"{good} of {done} kills: resumed, 0 records lost, landed")
    return 0 if good == done else 1


if __name__ == "__main__":
    sys.exit(main())
