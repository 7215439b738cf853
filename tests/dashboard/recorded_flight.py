"""A campaign in the store as a flight would have left it there: launch, six slots, a lost link, a pause, way home."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from moving_flight import Rounds, Sight, reasons, slot_records

from gcs.ports import DecisionRecord, Event, FlightMode, Landed, Severity, SlotRecord, TelemetrySample, VehicleStatus
from gcs.store.store import Store
from policy.evaluation.rollout import fly
from policy.mission_file import load_mission, open_campaign

BEGUN_S = 100.0  # flight clock at the launch
LAUNCH_S, PAUSE_S, HOME_S = 20.0, 30.0, 20.0
SLOTS, SLOT_S = 6, 15.0
PAUSED_AT_S = LAUNCH_S + 1.5 * SLOT_S  # into the recording; within slot 1
LOST_AT_S = LAUNCH_S + 3 * SLOT_S + PAUSE_S + 1.0
HEARD_AT_S = LOST_AT_S + 12.0
LENGTH_S = LAUNCH_S + SLOTS * SLOT_S + PAUSE_S + HOME_S
FRAME = load_mission("demo").scenario.area.frame
CLIMB_S = 10.0  # of the launch that fails
FAILED_WORDS = "no drone is left: UAV 1 did not climb"
LOST_WORDS = "UAV 2 is not heard any more"


def record_campaign(store: Store) -> str:
    """The id of a campaign that is over."""
    mission = load_mission("demo")
    campaign = store.campaigns.create(mission, "ann")
    records = flown_records()
    journal = store.journal
    for record in records:
        journal.record_slot(campaign.id, record)
    for second in range(int(LENGTH_S) + 1):
        vehicles = tuple(vehicle_at(records, i, float(second)) for i in (1, 2))
        journal.record_telemetry(campaign.id, TelemetrySample(BEGUN_S + second, vehicles))
    for slot, record in enumerate(records[:-1]):
        journal.record_decision(campaign.id, decision_of(record, records[slot + 1]))
    for event in events():
        journal.record(replace(event, time_s=BEGUN_S + event.time_s, campaign_id=campaign.id))
    assert journal.flush(10.0)
    return campaign.id


def decision_of(before: SlotRecord, after: SlotRecord) -> DecisionRecord:
    """Made a moment after the slot began. Slot 3 was recorded by an older version; in slot 4 the policy broke."""
    told: dict[int, Mapping[str, Any] | None] = {3: None, 4: Broken()}
    return DecisionRecord(
        slot=before.slot,
        pos_enu_m=tuple((uav.east_m, uav.north_m) for uav in before.uavs),
        vel_enu_mps=tuple((0.0, 0.0) for _ in before.uavs),
        energy_left_j=tuple(1e6 - uav.energy_j for uav in before.uavs),
        active=tuple(uav.active for uav in before.uavs),
        heading_rad=tuple(math.radians(uav.heading_deg) for uav in after.uavs),
        speed_mps=tuple(uav.speed_mps for uav in after.uavs),
        duration_ms=2.0,
        time_s=before.time_s + 0.1,
        explanation=told.get(before.slot, reasons(before)),
    )


class Broken(Mapping[str, Any]):
    """Reasons that cannot be worked out."""

    def __getitem__(self, key: str) -> Any:
        raise RuntimeError("the network is gone")

    def __iter__(self) -> Iterator[str]:
        raise RuntimeError("the network is gone")

    def __len__(self) -> int:
        return 1


def record_failed_launch(store: Store) -> str:
    """The id of a campaign that failed while its drones climbed: no slot."""
    campaign = store.campaigns.create(load_mission("demo"), "ann")
    records = flown_records()
    for second in range(int(CLIMB_S) + 1):
        vehicles = tuple(vehicle_at(records, i, float(second)) for i in (1, 2))
        store.journal.record_telemetry(campaign.id, TelemetrySample(BEGUN_S + second, vehicles))
    for at_s, name, reason in ((0.0, "launching", ""), (CLIMB_S, "failed", FAILED_WORDS)):
        data = {"state": name, "reason": reason}
        store.journal.record(Event(BEGUN_S + at_s, "campaign.state", name, campaign_id=campaign.id, data=data))
    assert store.journal.flush(10.0)
    return campaign.id


def flown_records() -> list[SlotRecord]:
    """The slots of the world model's flight, by the flight clock."""
    scenario, traces = open_campaign(load_mission("demo"))
    assert traces is not None
    flown = slot_records(fly(replace(scenario, slots=SLOTS), Sight(traces), Rounds()))
    return [replace(record, time_s=BEGUN_S + slot_end_s(record.slot)) for record in flown]


def slot_end_s(slot: int) -> float:
    """Seconds into the recording; the pause lies in slot 1."""
    return LAUNCH_S + slot * SLOT_S + (PAUSE_S if slot > 1 else 0.0)


def events() -> list[Event]:
    def state(at_s: float, name: str) -> Event:
        return Event(at_s, "campaign.state", f"-> {name}", data={"state": name})

    refused = {"command": "hold", "result": "refused", "reason": "no GPS", "attempts": 1}
    return [
        state(0.0, "launching"),
        state(LAUNCH_S, "flying"),
        Event(LAUNCH_S + 2.0, "command.verdict", "drone 1 hold: refused: no GPS", system_id=1, data=refused),
        state(PAUSED_AT_S, "paused"),
        state(PAUSED_AT_S + PAUSE_S, "flying"),
        Event(LOST_AT_S, "link.lost", LOST_WORDS, Severity.WARNING, system_id=2),
        Event(HEARD_AT_S + 1.0, "alert.acknowledged", f'"{LOST_WORDS}" acknowledged', system_id=2, actor="ann"),
        state(LENGTH_S - HOME_S, "recovering"),
        state(LENGTH_S, "done"),
    ]


def vehicle_at(records: list[SlotRecord], system_id: int, at_s: float) -> VehicleStatus:
    """On its pad, climbing, on the straight way of its slot, coming down: what it says at that moment."""
    height = 125.0 - 5.0 * system_id
    climbed = min(1.0, at_s / LAUNCH_S, (LENGTH_S - at_s) / HOME_S)
    slots = min(SLOTS - 1e-6, max(0.0, (at_s - LAUNCH_S - paused_s(at_s)) / SLOT_S))
    before, after = records[int(slots)].uavs[system_id - 1], records[int(slots) + 1].uavs[system_id - 1]
    share = slots - int(slots)
    east_m, north_m = (a + share * (b - a) for a, b in ((before.east_m, after.east_m), (before.north_m, after.north_m)))
    lat_deg, lon_deg = FRAME.to_geodetic_deg(east_m, north_m)
    home_deg = FRAME.to_geodetic_deg(800.0, 600.0)
    heading_rad = math.atan2(after.east_m - before.east_m, after.north_m - before.north_m)
    moves = LAUNCH_S < at_s < LENGTH_S - HOME_S and not PAUSED_AT_S <= at_s < PAUSED_AT_S + PAUSE_S
    speed_mps = after.speed_mps if moves else 0.0
    silent = system_id == 2 and LOST_AT_S < at_s < HEARD_AT_S
    heard_s = BEGUN_S + (LOST_AT_S if silent else at_s - 0.2)
    on_ground = climbed <= 0.0
    mode, name = (
        (FlightMode.HOLD, "AUTO.LOITER") if on_ground
        else (FlightMode.TAKEOFF, "AUTO.TAKEOFF") if at_s < LAUNCH_S
        else (FlightMode.LAND, "AUTO.LAND") if at_s > LENGTH_S - HOME_S
        else (FlightMode.GUIDED, "OFFBOARD")
    )  # fmt: skip
    return VehicleStatus(
        system_id,
        autopilot="px4",
        mode=mode,
        mode_name=name,
        armed=not on_ground,
        landed=Landed.ON_GROUND if on_ground else Landed.IN_AIR,
        position_ready=True,
        lat_deg=float(lat_deg),
        lon_deg=float(lon_deg),
        alt_home_m=height * max(0.0, climbed),
        vel_ned_mps=(speed_mps * math.cos(heading_rad), speed_mps * math.sin(heading_rad), 0.0),
        yaw_rad=heading_rad,
        home_lat_deg=float(home_deg[0]),
        home_lon_deg=float(home_deg[1]),
        battery_fraction=0.9 - 0.002 * at_s,
        heartbeat_s=heard_s,
        position_s=heard_s,
        loss_ratio=0.02,
    )


def paused_s(at_s: float) -> float:
    """How long the slot clock has stood still until then."""
    return min(PAUSE_S, max(0.0, at_s - PAUSED_AT_S))
