"""What a hundred vehicles cost the server by part, CPU time on one thread: no sockets, so a busy machine matters less.

The whole, with sockets, pages and requests, is the load bench's; this one says where its time goes.
"""

import gc
import importlib
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from measures import summary
from pymavlink.dialects.v20 import ardupilotmega as mav

from gcs.api.auth import Actor
from gcs.api.schemas import Subscribe
from gcs.api.stream_session import StreamSession
from gcs.api.stream_source import SnapshotSource, change_text
from gcs.collector import leave_what_is_loaded
from gcs.links.fleet_link import WiredFleetLink
from gcs.links.pymavlink_link import PymavlinkWire
from gcs.links.transport import Peer
from gcs.ports import (
    CampaignSnapshot,
    CampaignState,
    Event,
    FlightSnapshot,
    Severity,
    SlotRecord,
    UavPlan,
    UavTrack,
    UserSlot,
    VelocitySetpoint,
)
from gcs.safety.envelope import Envelope
from gcs.safety.gate import SafetyGate, Wish
from gcs.store.event_tail import EventTail
from gcs.store.keys import Role
from policy.world.frames import LocalFrame

VEHICLES, CLIENTS, TICK_S, WARM_TICKS = 100, 20, 0.1, 20
LAT_E7, LON_E7 = 404_203_000, -869_300_000
FRAME = LocalFrame(LAT_E7 / 1e7, LON_E7 / 1e7)
Row = tuple[str, str, str]


def fleet_cost(quick: bool) -> list[Row]:
    """Microseconds a message and setpoint, milliseconds a tick and its text."""
    fleet, ticks = Fleet(), 40 if quick else 150
    poll_us, send_us, flush_ms, tell_ms, text_ms = [], [], [], [], []
    shown, before = Shown(), None
    source = SnapshotSource(shown, EventTail(), Statics())  # type: ignore[arg-type]
    for tick in range(ticks):
        now_s = tick * TICK_S
        count = fleet.say(tick)
        poll_us.append(_cpu_s(lambda now_s=now_s: fleet.link.poll(now_s)) / count)
        send_us.append(_cpu_s(lambda now_s=now_s: fleet.send(now_s)) / VEHICLES)
        flush_ms.append(_cpu_s(lambda now_s=now_s: fleet.link.flush(now_s)))
        shown.newest = fleet.snapshot(now_s, tick)
        tell_ms.append(_cpu_s(lambda: source.newest().told))
        now = source.newest().told
        text_ms.append(_cpu_s(lambda before=before, now=now: change_text(before, now)))
        before = now
    last = slice(WARM_TICKS, None)
    return [
        ("a message taken in, mean of 63 a second and vehicle", summary(poll_us[last], 1e6), "us"),
        ("a setpoint sent", summary(send_us[last], 1e6), "us"),
        ("time requests, heartbeats and repeats, a tick", summary(flush_ms[last], 1e3), "ms"),
        ("a tick in the stream's words, all vehicles", summary(tell_ms[last], 1e3), "ms"),
        ("its change as text, for all clients of deltas", summary(text_ms[last], 1e3), "ms"),
        ("a slot's end and thirty events told to twenty clients of deltas", summary(_slot_ends_s(fleet), 1e3), "ms"),
        ("the gate, all vehicles in layers of a metre, a tick", summary(_gate_s(ticks), 1e3), "ms"),
        ("a full garbage collection with all that a server loads", summary(_collections(), 1e3), "ms"),
        ("the same when the server has been made", summary(_frozen_collections(), 1e3), "ms"),
    ]  # fmt: skip


def _cpu_s(act: Callable[[], object]) -> float:
    begun_s = time.process_time()
    act()
    return time.process_time() - begun_s


def _slot_ends_s(fleet: "Fleet") -> list[float]:
    """All clients have had the slot before."""
    shown, tail, statics = Shown(), EventTail(), Statics()
    source = SnapshotSource(shown, tail, statics)  # type: ignore[arg-type]
    actor, wish = Actor("page", Role.VIEWER), Subscribe(type="subscribe", deltas=True)
    clients = [StreamSession(actor, "1.0", source, tail, statics, wish) for _ in range(CLIENTS)]
    seconds = []
    for slot in range(12):
        users = tuple(
            UserSlot(f"user-{i}", 10.0 * i + slot / 3.0, 700.0 / (1 + slot), 3.0, 0.3, True) for i in range(59)
        )
        shown.newest = fleet.snapshot(15.0 * slot, slot, SlotRecord(slot, 15.0 * slot, (), users, None))
        for number in range(30):
            tail.append(
                Event(15.0 * slot, "gate.slowed", f"drone {number} slowed by the gate", Severity.INFO, "c1", number)
            )
        seconds.append(_cpu_s(lambda: [client.step() for client in clients]))
    return seconds[2:]  # the first of all is told whole


def _gate_s(ticks: int) -> list[float]:
    """All wish for their top speed, each its own way, from pads 4 m apart; judged where they are by then."""
    gate = SafetyGate(Envelope((1667.0, 1222.0), max_alt_home_m=155.0, vertical_separation_m=0.8))
    seconds = []
    for tick in range(ticks):
        ahead_m = 1.8 * tick if tick < 120 else 0.0
        wishes = []
        for index in range(VEHICLES):
            north, east = math.cos(index), math.sin(index)
            place_m = (600.0 + 4.0 * index + ahead_m * east, 600.0 + ahead_m * north)
            track = UavTrack(index + 1, *place_m, 150.0 - index, 18.0 * east, 18.0 * north, 0.0, 0.0, 0.05)
            wishes.append(Wish(VelocitySetpoint(index + 1, (18.0 * north, 18.0 * east, 0.0), 0.0), track))
        seconds.append(_cpu_s(lambda wishes=wishes: gate.judge(wishes)))
    return seconds


def _collections() -> list[float]:
    importlib.import_module("gcs.api.app")
    return [_cpu_s(gc.collect) for _ in range(5)]


def _frozen_collections() -> list[float]:
    thresholds = gc.get_threshold()
    leave_what_is_loaded()
    try:
        return _collections()
    finally:
        gc.unfreeze()
        gc.set_threshold(*thresholds)


class Statics:
    """What a stream knows of the campaign."""

    def static(self, campaign_id: str) -> None: ...

    def frame(self, campaign_id: str) -> LocalFrame:
        return FRAME

    def battery_j(self, campaign_id: str) -> float:
        return 350_000.0


class Shown:
    """A flight that shows what it is given."""

    def __init__(self) -> None:
        self.newest = FlightSnapshot(0.0, 0)

    def snapshot(self) -> FlightSnapshot:
        return self.newest

    def healthy(self) -> bool:
        return True


@dataclass
class Way:
    """A transport without a socket."""

    address: str
    waiting: list[tuple[Peer, bytes]] = field(default_factory=list)
    sent: list[bytes] = field(default_factory=list)
    skipped: int = 0

    def read(self, now_s: float) -> list[tuple[Peer, bytes]]:
        given, self.waiting = self.waiting, []
        return given

    def write(self, data: bytes, peer: Peer | None) -> None:
        self.sent.append(data)

    def peers(self) -> list[Peer]:
        return []

    def close(self) -> None: ...


@dataclass(frozen=True)
class Passed:
    setpoint: VelocitySetpoint
    passed_gate: bool = True


class Fleet:
    """Vehicles that say what ArduPilot says when asked for the usual streams, and answer time requests."""

    def __init__(self) -> None:
        self.ways = [Way(f"udpout:127.0.0.1:{20_000 + index}") for index in range(VEHICLES)]
        expected = {way.address: index + 1 for index, way in enumerate(self.ways)}
        self.link = WiredFleetLink(PymavlinkWire(self.ways), expected)
        self._codecs = [mav.MAVLink(None, srcSystem=index + 1, srcComponent=1) for index in range(VEHICLES)]
        path_m = tuple((10.0 * step, 23.7 * step) for step in range(6))
        self._plans = tuple(UavPlan(index + 1, 0.1, 10.0, path_m) for index in range(VEHICLES))

    def say(self, tick: int) -> int:
        """What all vehicles send within a tick; how many messages."""
        for index, codec in enumerate(self._codecs):
            for message in (*_messages(codec, tick, index), *self._answers(codec, tick, index)):
                frame = bytes(message.pack(codec))
                codec.seq = (codec.seq + 1) % 256
                self.ways[index].waiting.append((("127.0.0.1", 20_000 + index), frame))
        return sum(len(way.waiting) for way in self.ways)

    def send(self, now_s: float) -> None:
        """A setpoint each."""
        for index in range(VEHICLES):
            self.link.send(Passed(VelocitySetpoint(index + 1, (1.0, 2.0, 0.0), 0.3)), now_s)

    def snapshot(self, now_s: float, tick: int, latest: SlotRecord | None = None) -> FlightSnapshot:
        """As the flight loop publishes it."""
        campaign = CampaignSnapshot(
            "c1", "load", "random", CampaignState.FLYING, 3, 120, 15.0, now_s % 15.0, plans=self._plans, latest=latest
        )
        return FlightSnapshot(now_s, tick, tuple(self.link.vehicles().values()), campaign)

    def _answers(self, codec: Any, tick: int, index: int) -> list[Any]:
        asked = [codec.decode(bytearray(frame)) for frame in self.ways[index].sent if frame[7:10] == b"\x6f\x00\x00"]
        self.ways[index].sent.clear()
        return [codec.timesync_encode(tick * 10**8 + 1, question.ts1) for question in asked if question.tc1 == 0]


def _messages(codec: Any, tick: int, index: int) -> list[Any]:
    boot_ms = 1000 + tick * 100
    found = [
        codec.global_position_int_encode(boot_ms, LAT_E7 + 50 * tick, LON_E7 + index, 336_000, 150_000, 100, 100, 0, 0),
        codec.local_position_ned_encode(boot_ms, 1.0, 2.0, -3.0, 0.1, 0.1, 0.1),
        codec.attitude_encode(boot_ms - 50, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0),
        codec.attitude_encode(boot_ms, 0.1, 0.2, 0.31, 0.0, 0.0, 0.0),
    ]
    if tick % 3 == 0:
        found.append(codec.vfr_hud_encode(1.0, 2.0, 90, 50, 30.0, 0.1))
    if tick % 5 == 0:
        found += [
            codec.sys_status_encode(1 << 28, 1 << 28, 1 << 28, 100, 22_000, 1000, 80, 0, 0, 0, 0, 0, 0),
            codec.battery_status_encode(0, 0, 0, 2000, [22_000] * 10, 100, 1, 1, 80),
            codec.gps_raw_int_encode(boot_ms * 1000, 3, LAT_E7, LON_E7, 186_000, 100, 100, 1, 1, 10),
            codec.extended_sys_state_encode(0, 2),
        ]
    if tick == 0:
        found.append(codec.home_position_encode(LAT_E7, LON_E7, 186_000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))
    if tick % 10 == 0:
        found += [codec.heartbeat_encode(2, 3, 89, 4, 4), codec.ekf_status_report_encode(831, 0.1, 0.1, 0.1, 0.1, 0.1)]
    return found
