"""A hundred drones, twenty pages and two hundred requests a second on one server: what it costs and who waits.

The drones are put into the air first; the server then takes their campaign up, as after a restart, and flies it. Mock,
pages and requests run in processes of their own; a relay before five of the drones stamps what goes by on the wire.
Each process has a session of its own: Linux shares a busy machine by sessions, and they stand for different machines.
A row says whether the mock kept up: where it did not, its drones' clocks fell behind, and the server, which takes that
for late messages, holds them.
"""

import json
import os
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import pairwise
from pathlib import Path
from typing import Any

import httpx
from autopilots import STREAMS, _cpu_s, _order
from measures import percentile, summary
from setpoints import ROOT, Relay, _start_server

from gcs.mission.states import Trigger
from gcs.ports import STALE_AFTER_S, CampaignState, Checkpoint, DroneCheckpoint, Event, SlotRecord, UavSlot, UserSlot
from gcs.store.store import using_store
from policy.mission_file import open_campaign, parse_mission

DRONES, REQUESTS_PER_S = 100, 200
WATCHED = (0, 24, 49, 74, 99)  # the first and the last to be told at each tick, and some between
POSITION_ID = 33  # GLOBAL_POSITION_INT
TOP_M, LAYER_M = 150.0, 1.0
MISSION: dict[str, Any] = {
    "campaign": {"name": "load", "slots": 120, "slot_s": 15.0},
    "area": {"south_west": [40.4203, -86.93], "size_m": [1667.0, 1222.0]},
    "fleet": {"uavs": DRONES, "altitude_m": TOP_M, "layer_m": LAYER_M, "launch_m": [400.0, 600.0]},
    "users": {"source": "walkers", "count": 59},
    "policy": {"name": "random"},
}  # fmt: skip
UP_S = 180.0
ELSEWHERE = 10  # nice value
Row = tuple[str, str, str]


def load(quick: bool) -> list[Row]:
    """CPU of the server alone, periods and losses on the wire, age of what a page is told."""
    measure_s = 10.0 if quick else 60.0
    with ExitStack() as stack:
        first = stack.enter_context(_drones_in_the_air())
        relay = stack.enter_context(StampingRelay([first + index for index in WATCHED]))
        addresses = dict(zip(WATCHED, relay.addresses, strict=True))
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        store = f"sqlite:///{folder}/load.db"
        _flying_campaign(store)
        ports = [addresses.get(index, first + index) for index in range(DRONES)]
        base, key, pid = _start_server(stack, ports, store)
        with httpx.Client(base_url=base, headers={"Authorization": f"Bearer {key}"}, timeout=30.0) as client:
            _wait_until_all_are_guided(client)
            calm = _measured(relay, pid, 10.0)
            long_s = str(measure_s + 5.0)
            pages = stack.enter_context(_clients("pages", base, key, long_s, str(WATCHED[0] + 1)))
            asking = stack.enter_context(_clients("ask", base, key, long_s, str(REQUESTS_PER_S)))
            _go(pages), _go(asking)
            time.sleep(4.0)  # twenty pages have had their first whole snapshot
            loaded = _measured(relay, pid, measure_s)
            told, asked = _answer(pages), _answer(asking)
            vehicles = client.get("/api/v1/drones").json()
            campaign = client.get("/api/v1/campaigns").json()[0]
    ages_s, latencies_s = relay.ages_s(told["positions"]), asked["latencies_s"]
    held = sum(vehicle["position_age_s"] > STALE_AFTER_S for vehicle in vehicles)
    lossy = sum(vehicle["loss_ratio"] > 0.001 for vehicle in vehicles)
    rows: list[Row] = [
        ("drones flown, campaign", f"{sum(v['mode'] == 'guided' for v in vehicles)}, {campaign['state']}", ""),
        ("messages of a drone to the server", f"{loaded.received / measure_s / len(WATCHED):.1f}", "1/s"),
        ("setpoints of a drone", f"{loaded.sent / measure_s / len(WATCHED):.1f}", "1/s"),
        ("snapshots to a page", f"{told['snapshots'] / told['pages'] / (measure_s + 5.0):.1f}", "1/s"),
        (f"requests answered, of {REQUESTS_PER_S} a second", f"{len(latencies_s) / (measure_s + 5.0):.0f}", "1/s"),
        ("server's CPU, drones only", f"{calm.cores:.2f}", "cores"),
        ("server's CPU, all", f"{loaded.cores:.2f}", "cores"),
        ("drones whose position was too old to steer by, at the end", f"{held}", ""),
        ("drones' own clock against this one's (1 = the mock keeps up)", f"{loaded.pace:.2f}", ""),
        ("setpoint period, drones only", summary(calm.periods_s, 1e3), "ms"),
        ("setpoint period, all", summary(loaded.periods_s, 1e3), "ms"),
        ("setpoint period, drones only, 99.9th percentile", f"{1e3 * percentile(calm.periods_s, 0.999):.1f}", "ms"),
        ("setpoint period, all, 99.9th percentile", f"{1e3 * percentile(loaded.periods_s, 0.999):.1f}", "ms"),
        ("drones that lost over 0.1 % of their last messages, at the end", f"{lossy}", ""),
        ("datagrams dropped at the server's sockets", f"{loaded.dropped}", ""),
        ("position leaving a drone to a page having it", summary(ages_s, 1e3), "ms"),
        ("the same, 99th percentile", f"{1e3 * percentile(ages_s, 0.99):.1f}", "ms"),
        ("request, 99th percentile", f"{1e3 * percentile(latencies_s, 0.99):.1f}", "ms"),
        ("requests that failed", f"{asked['failed']}", ""),
    ]  # fmt: skip
    return [*rows, ("other work on the machine while measuring", f"{loaded.others_cores:.2f}", "cores")]


class Measured:
    """What went by within a while."""

    def __init__(self, relay: "StampingRelay", pid: int, duration_s: float) -> None:
        begun_s, begun_cpu_s, begun_busy_s, own_s = time.perf_counter(), _cpu_s(pid), _busy_s(), _everybody_of_ours_s()
        dropped, received = _dropped(pid), relay.received
        time.sleep(duration_s)  # the measurement's length
        took_s = time.perf_counter() - begun_s
        self.cores = (_cpu_s(pid) - begun_cpu_s) / took_s
        self.others_cores = max(0.0, (_busy_s() - begun_busy_s - (_everybody_of_ours_s() - own_s)) / took_s)
        self.dropped, self.received = _dropped(pid) - dropped, relay.received - received
        self.pace = relay.pace(begun_s)
        stamps = [[s for s in relay.stamps[index] if s >= begun_s] for index in range(len(WATCHED))]
        self.sent = sum(map(len, stamps))
        self.periods_s = [later - earlier for one in stamps for earlier, later in pairwise(one)]


def _measured(relay: "StampingRelay", pid: int, duration_s: float) -> Measured:
    return Measured(relay, pid, duration_s)


class StampingRelay(Relay):
    """Also counts what comes from the drones and remembers when each position of the first one left."""

    def __init__(self, targets: list[int]) -> None:
        super().__init__(targets)
        self.received = 0
        self.left_s: dict[tuple[int, int], list[float]] = {}  # of a place: each time that the drone came to it
        self._place: tuple[int, int] | None = None
        self.booted_s: list[tuple[float, float]] = []  # our time, and the first drone's own since boot

    def note(self, index: int, data: bytes, *, from_server: bool) -> None:
        """One datagram."""
        super().note(index, data, from_server=from_server)
        if from_server:
            return
        self.received += 1
        if index == 0 and len(data) > 26 and data[0] == 0xFD and int.from_bytes(data[7:10], "little") == POSITION_ID:
            now_s = time.perf_counter()
            place = struct.unpack_from("<ii", data, 14)
            if place != self._place:
                self.left_s.setdefault(place, []).append(now_s)
                self._place = place
            self.booted_s.append((now_s, struct.unpack_from("<I", data, 10)[0] / 1e3))

    def pace(self, since_s: float) -> float:
        """Seconds on the first drone's clock for each of ours."""
        (first_s, booted_s), *_, (last_s, last_booted_s) = [one for one in self.booted_s if one[0] >= since_s]
        return (last_booted_s - booted_s) / (last_s - first_s)

    def ages_s(self, positions: list[tuple[float, float, float]]) -> list[float]:
        """How old each position (receipt, latitude, longitude) was when a page had it."""
        ages_s = []
        for at_s, lat, lon in positions:
            before = [left_s for left_s in self.left_s.get((round(lat * 1e7), round(lon * 1e7)), ()) if left_s <= at_s]
            if before:  # a drone that hovers is at one place again and again: the newest time is meant
                ages_s.append(at_s - before[-1])
        return ages_s


@contextmanager
def _drones_in_the_air() -> Iterator[int]:
    """A process of mock drones, each hovering in its layer over its pad; the first port."""
    scenario = parse_mission(MISSION, origin="load").scenario
    lat, lon = scenario.area.frame.to_geodetic_deg(*(float(v) for v in scenario.launch_enu_m[0]))
    first = 22_000
    words = ["--count", str(DRONES), "--flavour", "ardupilot", "--first-port", str(first), "--ready-after-s", "1"]
    command = [sys.executable, "-m", "sitl_mock", *words, "--home", f"{lat:.7f},{lon:.7f},186"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        try:
            assert process.stdout is not None
            for _ in range(DRONES):
                process.stdout.readline()
            _send_up(first)
            yield first
        finally:
            process.terminate()


def _send_up(first: int) -> None:
    """Orders until each drone is at its layer: what is lost or refused is given again."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
        station.settimeout(0.5)
        height_m = dict.fromkeys(range(DRONES), 0.0)
        until_s, due_s = time.monotonic() + UP_S, 0.0
        while low := [i for i in height_m if height_m[i] < TOP_M - LAYER_M * i - 1.0]:
            assert time.monotonic() < until_s, f"drones {low} did not climb"
            if time.monotonic() >= due_s:
                due_s = time.monotonic() + 5.0
                for index in low:
                    alt_m = TOP_M - LAYER_M * index
                    orders = [(511, POSITION_ID, 1e6)]
                    if height_m[index] < 1.0:
                        orders += [(176, 1, 4), (400, 1), (22, 0, 0, 0, 0, 0, 0, alt_m)]
                    for order in orders:
                        station.sendto(_order(index, *order), ("127.0.0.1", first + index))
            _hear(station, height_m)
        for index in range(DRONES):
            for message, rate_hz in STREAMS.items():
                station.sendto(_order(index, 511, message, 1e6 / rate_hz), ("127.0.0.1", first + index))


def _hear(station: socket.socket, height_m: dict[int, float]) -> None:
    try:
        data = station.recv(4096)
    except TimeoutError:
        return
    if len(data) > 32 and data[0] == 0xFD and int.from_bytes(data[7:10], "little") == POSITION_ID:
        height_m[data[5] - 1] = struct.unpack_from("<i", data, 26)[0] / 1e3  # relative_alt, mm


def _flying_campaign(url: str) -> None:
    """The records of a campaign whose first slot had just begun when its server ended."""
    mission = parse_mission(MISSION, origin="load")
    scenario, traces = open_campaign(mission)
    assert traces is not None
    east_m, north_m = (float(v) for v in scenario.launch_enu_m[0])
    pads = [(east_m + 4.0 * index, north_m) for index in range(DRONES)]
    uavs = tuple(UavSlot(i + 1, *pad, 0.0, 0.0, 0.0) for i, pad in enumerate(pads))
    users = tuple(UserSlot(name, 500.0, 500.0, 1.0, 0.0, False) for name in traces.user_ids)
    drones = tuple(DroneCheckpoint(i + 1, "guided", pad, active=True) for i, pad in enumerate(pads))
    state, data = CampaignState.FLYING, {"state": "flying"}
    with using_store(url) as store:
        campaign_id = store.campaigns.create(mission, "bench").id
        store.journal.record(Event(0.0, "campaign.state", "launching -> flying", campaign_id=campaign_id, data=data))
        store.journal.record_slot(campaign_id, SlotRecord(0, 0.0, uavs, users, None))
        store.journal.checkpoint(Checkpoint(campaign_id, state, Trigger.LANDED.value, "", 0, 0.0, 15.0, 4.5, 0, drones))


def _wait_until_all_are_guided(client: httpx.Client) -> None:
    until_s = time.monotonic() + 60.0
    while (count := sum(v["mode"] == "guided" for v in client.get("/api/v1/drones").json())) < DRONES:
        assert time.monotonic() < until_s, f"only {count} drones were taken over"
        time.sleep(0.5)
    assert client.get("/api/v1/campaigns").json()[0]["state"] == "flying"
    time.sleep(5.0)  # their regain is over and the first slot flies


@contextmanager
def _clients(*words: str) -> Iterator["subprocess.Popen[str]"]:
    """A process of its own that has loaded and waits for a line, so that its work is not the server's."""
    command = [sys.executable, str(Path(__file__).with_name("load_clients.py")), *words]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, start_new_session=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            _put_elsewhere(process.pid)
            yield process
        finally:
            process.kill()


def _put_elsewhere(pid: int) -> None:
    """Phones and browsers have machines of their own: where they must share this one the server comes first."""
    os.setpriority(os.PRIO_PGRP, pid, ELSEWHERE)
    with suppress(OSError):  # a kernel without groups of sessions has no such file
        Path(f"/proc/{pid}/autogroup").write_text(str(ELSEWHERE))


def _go(process: "subprocess.Popen[str]") -> None:
    assert process.stdin is not None
    process.stdin.write("go\n")
    process.stdin.flush()


def _answer(process: "subprocess.Popen[str]") -> dict[str, Any]:
    assert process.stdout is not None
    answer: dict[str, Any] = json.loads(process.stdout.readline())
    return answer


def _dropped(pid: int) -> int:
    """Datagrams that the kernel threw away at this process's UDP sockets (last column of /proc/net/udp)."""
    inodes = set()
    for entry in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(FileNotFoundError):  # closed since it was listed
            target = str(entry.readlink())
            if target.startswith("socket:["):
                inodes.add(target[8:-1])
    rows = [line.split() for line in Path(f"/proc/{pid}/net/udp").read_text(encoding="ascii").splitlines()[1:]]
    return sum(int(row[-1]) for row in rows if row[9] in inodes)


def _busy_s() -> float:
    """CPU seconds that the whole machine has worked."""
    fields = Path("/proc/stat").read_text(encoding="ascii").splitlines()[0].split()[1:]
    user, nice, system, _idle, _wait, irq, softirq = map(int, fields[:7])
    return (user + nice + system + irq + softirq) / os.sysconf("SC_CLK_TCK")


def _everybody_of_ours_s() -> float:
    """CPU seconds of this process and all that it started."""
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text(encoding="ascii").rpartition(")")[2].split()
            except OSError:
                continue
            children.setdefault(int(fields[1]), []).append(int(entry.name))
    total_s, waiting = 0.0, [os.getpid()]
    while waiting:
        pid = waiting.pop()
        waiting += children.get(pid, [])
        try:
            total_s += _cpu_s(pid)
        except OSError:
            continue
    return total_s
