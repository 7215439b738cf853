"""A day of campaigns on the virtual clock in one process: does its memory stay flat, and is anything left behind?

One server: store, link with its sockets, flight loop, API, streams that stay and streams that come and go. Between
two campaigns the mock drones are switched off and on again at the same addresses, as when batteries are changed.

python tests/soak/day.py --hours 24
"""

import argparse
import asyncio
import gc
import secrets
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import psutil
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

from gcs.api.app import create_app
from gcs.api.listening import open_listener, shown_address
from gcs.api.server import serving
from gcs.api.settings import ApiSettings
from gcs.bootstrap import make_loop, make_preparer
from gcs.cli.mock_fleet import MockFleet, MockOptions, free_udp_ports, mock_fleet
from gcs.clock import LockstepClock
from gcs.flight_loop import FlightLoop
from gcs.links.pymavlink_link import PymavlinkFleetLink
from gcs.mission.states import FINAL
from gcs.store.store import using_store
from policy.mission_file import parse_mission

UAVS = 2
STREAMS = 3  # clients that stay all day
REST_PAUSE_S = 0.1
POOLED = ("AnyIO worker thread", "asyncio_")  # come and go with the load, never more than their pools allow


def mission(slots: int, policy: str) -> dict[str, Any]:
    """Fifteen minutes with 60 slots: a battery's worth."""
    return {
        "campaign": {"name": "a day", "slots": slots, "slot_s": 15.0},
        "area": {"south_west": [40.4203, -86.93], "size_m": [1667.0, 1222.0]},
        "fleet": {"uavs": UAVS, "altitude_m": 60.0, "max_speed_mps": 15.0, "launch_m": [873.0, 611.0]},
        "users": {"source": "walkers", "count": 30},
        "policy": {"name": policy},
    }


@dataclass(frozen=True)
class Sample:
    """After a campaign: what the process holds."""

    flown_s: float  # virtual
    memory_mb: float
    threads: int
    files: int  # sockets and files
    tasks: int
    objects: int


@dataclass
class Day:
    """What was seen."""

    samples: list[Sample] = field(default_factory=list)
    ends: list[str] = field(default_factory=list)
    wall_s: float = 0.0

    @property
    def hours(self) -> float:
        """On the virtual clock."""
        return self.samples[-1].flown_s / 3600.0

    def growth(self) -> float:
        """Median memory of the last quarter over that of the second one, less one."""
        quarter = max(1, len(self.samples) // 4)
        early = statistics.median(sample.memory_mb for sample in self.samples[quarter : 2 * quarter])
        late = statistics.median(sample.memory_mb for sample in self.samples[-quarter:])
        return late / early - 1.0

    def left(self) -> dict[str, int]:
        """More of each than after the first campaign."""
        first, last = self.samples[0], self.samples[-1]
        return {name: getattr(last, name) - getattr(first, name) for name in ("threads", "files", "tasks")}


class PowerCycledClock:
    """ports.FlightClock that goes on while the simulator behind it is ended and started anew."""

    is_virtual = True

    def __init__(self) -> None:
        self._inner: LockstepClock | None = None
        self._before_s = 0.0

    def attach(self, fleet: MockFleet) -> None:
        """Time goes on from where it was."""
        self._inner = LockstepClock(fleet.clock)

    def detach(self) -> None:
        """The simulator ends when its clock hangs up."""
        assert self._inner is not None
        self._before_s = self.now_s()
        self._inner.close()
        self._inner = None

    def now_s(self) -> float:
        """Seconds since the first simulator began."""
        return self._before_s + (0.0 if self._inner is None else self._inner.now_s())

    def wait_until(self, time_s: float) -> None:
        """Let the vehicles fly."""
        assert self._inner is not None
        self._inner.wait_until(time_s - self._before_s)


def spend(hours: float, *, slots: int = 60, policy: str = "random", least: int = 1, tell: bool = False) -> Day:
    """Fly campaign after campaign until the virtual clock shows ``hours`` and at least ``least`` are flown."""
    day, begun_s = Day(), time.monotonic()
    document = mission(slots, policy)
    scenario = parse_mission(document).scenario
    lat_deg, lon_deg = scenario.area.frame.to_geodetic_deg(*map(float, scenario.launch_enu_m[0]))
    port, clock = free_udp_ports(UAVS), PowerCycledClock()
    options = MockOptions(UAVS, (float(lat_deg), float(lon_deg), 186.0), extra=("--first-port", str(port)))
    key = secrets.token_urlsafe(16)
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        store = stack.enter_context(using_store(f"sqlite:///{folder}/day.db"))
        addresses = {f"udpout:127.0.0.1:{port + i}": i + 1 for i in range(UAVS)}
        link = stack.enter_context(closing(PymavlinkFleetLink(list(addresses), addresses)))
        loop = make_loop(clock, link, store.journal, make_preparer(tuple(range(1, UAVS + 1))))
        listener = stack.enter_context(closing(open_listener("127.0.0.1", 0)))
        settings = ApiSettings(one_time_key=key, dashboard=Path(folder), rate_per_s=100_000.0)
        stack.enter_context(serving(create_app(loop, store, settings), listener))
        client = Client(shown_address(listener), key)
        stack.callback(client.close)
        for _ in range(STREAMS):
            stack.enter_context(client.streaming())
        while len(day.samples) < least or day.hours < hours:
            with mock_fleet(options) as fleet:
                clock.attach(fleet)
                day.ends.append(_fly(loop, client, document))
                clock.detach()
            assert store.journal.flush(60.0)
            day.samples.append(_sample(clock.now_s()))
            if tell and len(day.samples) % 10 == 0:
                print(f"{day.hours:5.1f} h, {len(day.samples)} campaigns: {day.samples[-1]}", flush=True)
        day.wall_s = time.monotonic() - begun_s
    return day


class Client:
    """Who uses the server: orders, polling, streams."""

    def __init__(self, base: str, key: str) -> None:
        self._http = httpx.Client(
            base_url=f"{base}api/v1", headers={"authorization": f"Bearer {key}"}, timeout=60.0, trust_env=False
        )
        self._stream_url = base.replace("http", "ws") + "api/v1/stream?rate_hz=20"

    def close(self) -> None:
        """Hang up."""
        self._http.close()

    @contextmanager
    def streaming(self) -> Iterator[None]:
        """A client of the stream in a thread of its own."""
        with connect(self._stream_url, proxy=None) as socket:
            thread = threading.Thread(target=_drain, args=(socket,))
            thread.start()
            try:
                yield
            finally:
                socket.close()
                thread.join()

    def fly(self, document: dict[str, Any], over: threading.Event) -> None:
        """Create, start when the drones are ready, look at everything until it is over."""
        made = self._http.post("/campaigns", json=document).raise_for_status().json()["id"]
        while not over.is_set() and self._http.post(f"/campaigns/{made}/start").status_code != 202:
            over.wait(REST_PAUSE_S)
        with self.streaming():
            while not over.wait(REST_PAUSE_S):
                for path in ("/drones", f"/campaigns/{made}", "/events?newest=true&limit=20"):
                    self._get(path)
        self._get(f"/campaigns/{made}/report")

    def _get(self, path: str) -> None:
        """A loop as fast as the machine can starves its clients: a connection left idle for long is made anew."""
        try:
            self._http.get(path).raise_for_status()
        except httpx.TransportError:
            self._http.get(path).raise_for_status()


def _drain(socket: ClientConnection) -> None:
    try:
        for _ in socket:
            pass
    except WebSocketException:
        return


def _fly(loop: FlightLoop, client: Client, document: dict[str, Any]) -> str:
    """One campaign; the loop has this thread."""
    over = threading.Event()
    before = loop.snapshot().campaign
    thread = threading.Thread(target=client.fly, args=(document, over))
    thread.start()

    def ended(snapshot: Any) -> bool:
        campaign = snapshot.campaign
        if not thread.is_alive():
            raise RuntimeError("the client of the server failed")
        return campaign is not None and campaign is not before and campaign.state in FINAL and _is_new(campaign, before)

    try:
        loop.run(until=ended)
    finally:
        over.set()
        thread.join()
    campaign = loop.snapshot().campaign
    assert campaign is not None
    return f"{campaign.state} {campaign.reason}".strip()


def _is_new(campaign: Any, before: Any) -> bool:
    return before is None or campaign.campaign_id != before.campaign_id


def _sample(flown_s: float) -> Sample:
    """What is held when everything of a campaign has come to rest."""
    time.sleep(0.5)
    gc.collect()
    process, objects = psutil.Process(), gc.get_objects()
    return Sample(
        flown_s=flown_s,
        memory_mb=process.memory_info().rss / 1e6,
        threads=process.num_threads() - sum(one.name.startswith(POOLED) for one in threading.enumerate()),
        files=process.num_fds(),
        tasks=sum(issubclass(type(one), asyncio.Task) and not one.done() for one in objects),
        objects=len(objects),
    )


def main() -> int:
    """Fly, print the table, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--policy", default="random")
    parser.add_argument("--out", type=Path, help="also write the table here (Markdown)")
    args = parser.parse_args()
    day = spend(args.hours, policy=args.policy, tell=True)
    first, last, left = day.samples[0], day.samples[-1], day.left()
    done = day.ends.count("done")
    rows = [
        ("flown on the virtual clock", f"{day.hours:.1f} h in {day.wall_s / 60.0:.0f} min of wall time"),
        ("campaigns, flown to the end", f"{len(day.ends)}, {done}"),
        ("memory after the first campaign, after the last", f"{first.memory_mb:.0f} MB, {last.memory_mb:.0f} MB"),
        ("median of the last quarter over that of the second", f"{100.0 * day.growth():+.1f} %"),
        ("threads, first and last", f"{first.threads}, {last.threads}"),
        ("sockets and files, first and last", f"{first.files}, {last.files}"),
        ("asyncio tasks, first and last", f"{first.tasks}, {last.tasks}"),
        ("Python objects, first and last", f"{first.objects}, {last.objects}"),
    ]
    text = (
        "\n".join(["| what | figure |", "| --- | --- |", *(f"| {what} | {figure} |" for what, figure in rows)]) + "\n"
    )
    print(text)
    if args.out is not None:
        args.out.write_text(text, encoding="utf-8")
    good = done == len(day.ends) and day.growth() < 0.05 and max(left.values()) <= 0
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
