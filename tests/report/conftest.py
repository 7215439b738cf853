"""A small flown campaign: the world model, users that walk at random, UAVs that fly at random."""

import math

import numpy as np
import pytest

from gcs.ports import Event, Severity, SlotRecord, UavSlot, UserSlot
from gcs.report import MetricsRow, Provenance, ReportData
from policy.world.metrics import campaign_metrics
from policy.world.scenario import Area, Obstacle, Scenario
from policy.world.state import JointAction, WorldState, initial_state
from policy.world.transition import step

TOWER = Obstacle("tower <b>", 140.0, ((900.0, 200.0), (1000.0, 200.0), (1000.0, 330.0), (900.0, 330.0)))
SHED = Obstacle("shed", 20.0, ((300.0, 700.0), (420.0, 700.0), (420.0, 760.0), (300.0, 760.0)))


def make_scenario(slots: int = 30, users: int = 25, uavs: int = 2) -> Scenario:
    return Scenario(
        area=Area((40.42, -86.93), (1600.0, 1200.0), (TOWER, SHED)),
        launch_enu_m=np.tile([[800.0, 600.0]], (uavs, 1)),
        collect_mbps=np.full(users, 0.02),
        slots=slots,
    )


def record_of(scenario: Scenario, state: WorldState, headings, speeds, served, metrics) -> SlotRecord:
    used_j = scenario.battery_j - state.uav_energy_j
    uavs = tuple(
        UavSlot(
            i + 1, *map(float, state.uav_pos_enu_m[i]), math.degrees(headings[i]), float(speeds[i]), float(used_j[i])
        )
        for i in range(scenario.num_uavs)
    )
    users = tuple(
        UserSlot(
            f"u{i}", *map(float, place), float(state.user_aoi_slots[i]), float(state.user_data_mb[i]), bool(served[i])
        )
        for i, place in enumerate(state.user_pos_enu_m)
    )
    return SlotRecord(state.slot, state.slot * scenario.slot_s, uavs, users, metrics, None if metrics is None else 3.5)


def fly_at_random(scenario: Scenario, seed: int = 1) -> tuple[SlotRecord, ...]:
    rng = np.random.default_rng(seed)
    size = np.asarray(scenario.area.size_m)
    places = rng.uniform(0.0, 1.0, (scenario.num_users, 2)) * size
    state = initial_state(scenario, places)
    zeros = np.zeros(scenario.num_uavs)
    records = [record_of(scenario, state, zeros, zeros, np.zeros(scenario.num_users), None)]
    aoi, data, served = [], [], []
    for _ in range(scenario.slots):
        aim = size * rng.uniform(0.15, 0.85, (scenario.num_uavs, 2)) - state.uav_pos_enu_m
        headings = np.arctan2(aim[:, 0], aim[:, 1]) % (2.0 * np.pi)
        speeds = np.minimum(scenario.max_speed_mps, np.linalg.norm(aim, axis=1) / scenario.slot_s)
        places = np.clip(places + rng.normal(0.0, 12.0, places.shape), 0.0, size)
        state, outcome = step(scenario, state, JointAction(headings, speeds), places)
        aoi.append(state.user_aoi_slots)
        data.append(state.user_data_mb)
        served.append(outcome.served)
        energy = scenario.battery_j - state.uav_energy_j
        metrics = campaign_metrics(scenario, np.stack(aoi), np.stack(data), np.stack(served), energy)
        records.append(record_of(scenario, state, headings, speeds, outcome.served, metrics))
    return tuple(records)


def make_report(slots: int = 30, users: int = 25, uavs: int = 2) -> ReportData:
    scenario = make_scenario(slots, users, uavs)
    records = fly_at_random(scenario)
    other = fly_at_random(scenario, seed=2)[-1].metrics
    assert other is not None
    return ReportData(
        name="demo & <test>",
        policy="receding-horizon",
        scenario=scenario,
        records=records,
        comparison=(MetricsRow("random", other), MetricsRow("receding-horizon", other, "ideal motion")),
        events=(
            Event(0.0, "campaign.state", "ready -> launching"),
            Event(75.0, "gate.slowed", "UAV 2 slowed before the fence", Severity.CAUTION, system_id=2),
            Event(200.0, "link.lost", "no heartbeat from <UAV 1> for 5 s", Severity.WARNING, system_id=1),
        ),
        violations={"geofence": 0, "separation": 0, "obstacle": 1, "battery": 0},
        provenance=Provenance(
            command="python -m gcs fly missions/demo.toml --fleet mock --speedup max",
            mission={"campaign": {"name": "demo", "slots": slots}},
            seed=0,
            versions={"uav-crowdsensing": "0.1.0", "python": "3.11.9"},
            begun_utc="2026-01-02T03:04:05Z",
            wall_s=12.3,
        ),
    )


@pytest.fixture(scope="session")
def report() -> ReportData:
    return make_report()
