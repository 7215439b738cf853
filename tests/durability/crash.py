"""A real server killed with -9 while real mock drones fly for it, again and again; also a program of its own.

python tests/durability/crash.py --kills 50

A client listens to the stream all the time: whatever it was told must be in the store after the kill.
"""

import argparse
import json
import math
import random
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from gcs.cli.mock_fleet import free_udp_ports
from gcs.store.chain import ChainReport, verify_chain
from gcs.store.reading import EventFilter
from gcs.store.records import EventRecord
from gcs.store.store import Store, using_store

ROOT = Path(__file__).parents[2]
FINAL = {"done", "aborted", "failed"}
HOME = "40.4258,-86.9197,186"
POLL_S = 0.05
SLOTS = 8
SLOT_S = 15.0
KILLS = 10  # of one campaign
BACK_S = 5.0  # a restarted server is to be connected, reconciled and streaming again


def mission(slots: int) -> dict[str, Any]:
    """Two drones, low and close, so that a flight is short."""
    return {
        "campaign": {"name": "crash", "slots": slots, "slot_s": SLOT_S},
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
    born_at: datetime
    up_s: float
    opened_s: float
    listener: "Listener"

    def get(self, path: str) -> Any:
        """JSON of a GET; a busy machine may need a second try."""
        try:
            return self.client.get(path).raise_for_status().json()
        except httpx.TransportError:
            return self.client.get(path).raise_for_status().json()


class Listener:
    """A client of the stream that remembers what it was told, until the server dies."""

    def __init__(self, url: str, key: str) -> None:
        self.events: list[tuple[str, str]] = []  # kind, message
        self.slot = 0
        self._url, self._key = url, key
        self._thread = threading.Thread(target=self._listen, name="listener")
        self._thread.start()

    def join(self) -> None:
        """Everything that had left the server has been heard."""
        self._thread.join(20.0)

    def _listen(self) -> None:
        try:
            with connect(self._url, additional_headers={"authorization": f"Bearer {self._key}"}, proxy=None) as socket:
                for text in socket:
                    self._take(json.loads(text))
        except (OSError, WebSocketException):
            return  # killed

    def _take(self, message: dict[str, Any]) -> None:
        if message["type"] == "event":
            self.events.append((message["kind"], message["message"]))
        elif message["type"] == "snapshot" and message.get("campaign"):
            self.slot = max(self.slot, message["campaign"]["slot"])


@dataclass
class CrashLog:
    """What was seen of one campaign."""

    killed_in: list[str] = field(default_factory=list)
    up_s: list[float] = field(default_factory=list)
    streaming_s: list[float] = field(default_factory=list)  # from the birth of the process to its `campaign.resumed`
    resumed_s: list[float] = field(default_factory=list)  # from the address printed to the drones obeying again
    seen_slots: list[int] = field(default_factory=list)  # the newest slot told over REST before each kill
    kept_slots: list[int] = field(default_factory=list)  # the newest slot in the store after it
    told: list[int] = field(default_factory=list)  # events that the stream told each killed server's client
    forgotten: list[tuple[str, str]] = field(default_factory=list)  # told, but not in the store
    speedup: float = 1.0
    state: str = ""
    reason: str = ""
    slots: list[int] = field(default_factory=list)
    still_armed: list[int] = field(default_factory=list)
    events: list[EventRecord] = field(default_factory=list)
    chain: ChainReport | None = None

    def given(self, kind: str) -> set[int | None]:
        """To whom an order of this kind was given."""
        return {e.system_id for e in self.events if e.kind == "command.given" and e.data["command"] == kind}

    @property
    def whole(self) -> bool:
        """Every slot once, the audit log's chain unbroken, nothing told that is not in the store."""
        kept = all(kept >= seen for seen, kept in zip(self.seen_slots, self.kept_slots, strict=True))
        chained = self.chain is not None and self.chain.broken_id is None
        return self.slots == list(range(len(self.slots))) and chained and kept and not self.forgotten

    @property
    def late_s(self) -> float:
        """How much later than the wall clock says the last slot ended, in flight seconds; NaN without a last slot."""
        moves = [event for event in self.events if event.kind == "campaign.state"]
        begun = [event.recorded_at for event in moves if event.data["trigger"] == "launched"]
        ended = [event.recorded_at for event in moves if event.data["trigger"] == "last_slot"]
        if not begun or not ended:
            return math.nan
        return (ended[-1] - begun[-1]).total_seconds() * self.speedup - (len(self.slots) - 1) * SLOT_S

    @property
    def twice(self) -> list[int | None]:
        """Drones that were sent up twice."""
        return [system_id for system_id, times in Counter(self.orders("takeoff")).items() if times > 1]

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
    begun_s, born_at = time.monotonic(), datetime.now(UTC)
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
    listener = Listener(address[1].replace("http", "ws") + "/api/v1/stream?rate_hz=20", key)
    return Server(process, client, born_at, opened_s - begun_s, opened_s, listener)


def end(server: Server) -> None:
    """SIGKILL: nothing is put away."""
    server.process.kill()
    server.process.communicate()
    server.client.close()
    server.listener.join()


def crash(
    store: str, kill_after_s: list[float], *, speedup: float, slots: int, flavour: str = "px4", limit_s: float = 150.0
) -> CrashLog:
    """Fly a campaign over the store at this URL; kill the server so many seconds after it (or its successor) was up."""
    log = CrashLog(speedup=speedup)
    until_s = time.monotonic() + limit_s
    with mock_drones(speedup, flavour) as port:
        server = start_server(store, port, speedup)
        try:
            made = server.client.post("/campaigns", json=mission(slots)).raise_for_status().json()["id"]
            _wait_for_drones(server, until_s)
            _start(server, made, until_s)
            for after_s in kill_after_s:
                seen = _watch(server, made, log, time.monotonic() + after_s)
                if seen["state"] in FINAL:
                    break
                end(server)
                log.killed_in.append(seen["state"])
                log.seen_slots.append(max(seen["slot"], server.listener.slot))
                log.told.append(len(server.listener.events))
                with using_store(store) as kept:
                    log.kept_slots.append(kept.slots.progress(made)[0])
                    log.forgotten += _forgotten(server.listener.events, kept)
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


def _forgotten(told: list[tuple[str, str]], store: Store) -> list[tuple[str, str]]:
    """Told by the stream, and not in the store; the journal's own words about a failing store are not for it."""
    kept = Counter((event.kind, event.message) for event in store.events.find(EventFilter(), 100_000))
    lost = Counter(told) - kept
    return [one for one in lost if not one[0].startswith("store.")]


def _wait_for_drones(server: Server, until_s: float) -> None:
    while len([d for d in server.get("/drones") if d["position_ready"]]) < 2 and time.monotonic() < until_s:
        time.sleep(POLL_S)


def _start(server: Server, campaign: str, until_s: float) -> None:
    """As an operator does: again while the checklist is red (a busy machine loses messages before it has settled)."""
    while (answer := server.client.post(f"/campaigns/{campaign}/start")).status_code != 202:
        assert time.monotonic() < until_s, answer.text
        time.sleep(1.0)


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
        resumed = [moment for event in _items(told) if (moment := _moment(event)) >= server.born_at]
        if resumed and (obeying or seen["state"] != "flying"):
            log.streaming_s.append((min(resumed) - server.born_at).total_seconds())
            log.resumed_s.append(time.monotonic() - server.opened_s)
            return
        time.sleep(POLL_S)
    log.streaming_s.append(math.inf)
    log.resumed_s.append(math.inf)


def _items(page: Any) -> list[Any]:
    return page if isinstance(page, list) else next(value for value in page.values() if isinstance(value, list))


def _moment(event: dict[str, Any]) -> datetime:
    """When the store took it, which is a little after it happened."""
    return datetime.fromisoformat(event["recorded_at"]).astimezone(UTC)


def main() -> int:
    """Campaigns with random kills until there are enough; a table of what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--speedup", type=float, default=1.0, help="flight seconds a second (default 1)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="also write the table here (Markdown)")
    args = parser.parse_args()
    draw = random.Random(args.seed)
    logs: list[tuple[str, CrashLog]] = []
    while (left := args.kills - sum(len(log.killed_in) for _, log in logs)) > 0:
        moments = [draw.uniform(0.2, 30.0) / args.speedup for _ in range(min(KILLS, left))]
        flavour = draw.choice(["px4", "ardupilot"])
        with tempfile.TemporaryDirectory() as folder:
            store = f"sqlite:///{Path(folder) / 'crash.db'}"
            log = crash(
                store, moments, speedup=args.speedup, slots=SLOTS, flavour=flavour, limit_s=100.0 + 500.0 / args.speedup
            )
        logs.append((flavour, log))
        print(_row(flavour, log), flush=True)
        if not _is_good(log):
            print(_ending(log), flush=True)
    text, good = _table(logs)
    print(text)
    if args.out is not None:
        args.out.write_text(text, encoding="utf-8")
    return 0 if good else 1


def _row(flavour: str, log: CrashLog) -> str:
    stream = " ".join(f"{seconds:.1f}" for seconds in log.streaming_s)
    again = " ".join(f"{up + on:.1f}" for up, on in zip(log.up_s, log.resumed_s, strict=True))
    faults = f"forgotten {log.forgotten}, twice {log.twice}, armed {log.still_armed}"
    return (
        f"{flavour}: killed while {', '.join(log.killed_in)}; after the start of the process streaming {stream} s, "
        f"answering and obeyed {again} s; {log.state} {log.reason}; last slot {log.late_s:+.1f} s; "
        f"told {sum(log.told)} events; {faults}"
    )


def _ending(log: CrashLog, newest: int = 25) -> str:
    """How a campaign that went wrong ended, in its own events."""
    return "\n".join(f"    {event.time_s:8.1f} s {event.kind}: {event.message}" for event in log.events[-newest:])


def _is_good(log: CrashLog) -> bool:
    """It ended as it would have without a kill: all slots, on time, everyone down, nothing lost, nothing done twice."""
    ended = (log.state, log.still_armed) == ("done", []) and log.slots == list(range(SLOTS + 1))
    on_time = abs(log.late_s) <= BACK_S * log.speedup + 1.0  # killed as the last slot ends, it is closed after it
    return ended and on_time and log.whole and not log.twice


def _table(logs: list[tuple[str, CrashLog]]) -> tuple[str, bool]:
    """The table of ``docs/durability.md``, and whether everything was as it should be."""
    kills = sum(len(log.killed_in) for _, log in logs)
    resumed = sum(len(log.killed_in) for _, log in logs if _is_good(log))
    in_time = sum(seconds <= BACK_S for _, log in logs for seconds in log.streaming_s)
    states = Counter(state for _, log in logs for state in log.killed_in)
    told, forgotten = sum(sum(log.told) for _, log in logs), sum(len(log.forgotten) for _, log in logs)
    obeyed = [up + on for _, log in logs for up, on in zip(log.up_s, log.resumed_s, strict=True)]
    rows = [
        ("`kill -9`, over campaigns", f"{kills} in {len(logs)}"),
        ("killed while", ", ".join(f"{state} {count}" for state, count in sorted(states.items()))),
        ("taken up again, flown to the end in the right slots, landed", f"{resumed} of {kills}"),
        (f"connected, reconciled and streaming within {BACK_S:g} s of the process's start", f"{in_time} of {kills}"),
        ("events told by the stream before a kill; of these not in the store", f"{told}; {forgotten}"),
        ("campaigns with a slot that was told and is not in the store, a gap in the slots or a broken chain",
         str(sum(not log.whole for _, log in logs))),
        ("drones sent up twice", str(sum(len(log.twice) for _, log in logs))),
        ("campaigns that ended with a drone armed", str(sum(bool(log.still_armed) for _, log in logs))),
        ("end of the last slot against the wall clock, worst", f"{max(abs(log.late_s) for _, log in logs):.1f} s"),
        ("start of the process to streaming, median and worst", _spread(s for _, log in logs for s in log.streaming_s)),
        ("start of the process to its address, median and worst", _spread(s for _, log in logs for s in log.up_s)),
        ("start of the process to all drones seen obeying over REST, median and worst", _spread(obeyed)),
    ]  # fmt: skip
    text = "\n".join(["| what | figure |", "| --- | --- |", *(f"| {what} | {figure} |" for what, figure in rows)])
    return text + "\n", resumed == in_time == kills


def _spread(values_s: Iterable[float]) -> str:
    ordered_s = sorted(values_s)
    return f"{ordered_s[len(ordered_s) // 2]:.1f} s, {ordered_s[-1]:.1f} s"


if __name__ == "__main__":
    sys.exit(main())
