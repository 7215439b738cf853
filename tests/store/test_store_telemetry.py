"""Telemetry for looking back: read back as it was, bounded, and the first thing that a slow store goes without."""

import json
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcs.ports import Event, FlightMode, Landed, TelemetrySample, VehicleStatus
from gcs.store.engine import open_engine
from gcs.store.event_tail import EventTail
from gcs.store.journal import StoreJournal
from gcs.store.migrate import upgrade
from gcs.store.store import Store
from gcs.store.telemetry import Telemetry
from gcs.store.vehicle_rows import DIGITS, telemetry_document, telemetry_samples, vehicle_rows, vehicle_statuses

WAIT_S = 20.0
FLYING = VehicleStatus(
    7,
    autopilot="px4",
    mode=FlightMode.GUIDED,
    mode_name="OFFBOARD",
    armed=True,
    landed=Landed.IN_AIR,
    position_ready=True,
    lat_deg=40.4253123,
    lon_deg=-86.9200456,
    alt_home_m=119.9,
    vel_ned_mps=(3.01, -4.5, 0.0),
    yaw_rad=-0.512,
    home_lat_deg=40.42,
    home_lon_deg=-86.93,
    battery_fraction=0.753,
    battery_v=22.15,
    loss_ratio=0.013,
    heartbeat_s=9.7,
    position_s=9.9,
)
UNHEARD = VehicleStatus(8)
ANY = st.none() | st.floats(allow_nan=True, allow_infinity=True)
VEHICLE = st.builds(
    VehicleStatus,
    st.integers(1, 250),
    mode=st.sampled_from(FlightMode),
    landed=st.sampled_from(Landed),
    mode_name=st.text(st.characters(), max_size=9),
    lat_deg=ANY,
    battery_fraction=ANY,
    heartbeat_s=ANY,
    vel_ned_mps=st.tuples(*(st.floats(allow_nan=True),) * 3),
)


def test_samples_are_read_back_in_parts_and_by_campaign(store: Store) -> None:
    for at_s in (10.0, 11.0, 12.0):
        store.journal.record_telemetry("c", TelemetrySample(at_s, (FLYING, UNHEARD)))
    store.journal.record_telemetry("another", TelemetrySample(13.0, (UNHEARD,)))
    assert store.journal.flush(WAIT_S)
    times = store.telemetry.times("c")
    assert [one.time_s for one in times] == [10.0, 11.0, 12.0]
    found = store.telemetry.part("c", times[1].id, 1)
    assert found == [(times[1], TelemetrySample(11.0, (FLYING, UNHEARD)))]
    assert [at_s for at_s, _ in store.telemetry.rows("another")] == [13.0]


@given(vehicles=st.lists(VEHICLE, max_size=3).map(tuple))
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_a_vehicle_says_is_kept_and_never_refused(store: Store, vehicles: tuple[VehicleStatus, ...]) -> None:
    before = len(store.telemetry.times("any"))
    store.journal.record_telemetry("any", TelemetrySample(1.0, vehicles))
    assert store.journal.flush(WAIT_S)
    assert store.journal.health().lost == 0
    *_, (_, found) = store.telemetry.part("any", 0, before + 1)
    assert [(one.system_id, one.mode, one.landed) for one in found.vehicles] == [
        (one.system_id, one.mode, one.landed) for one in vehicles
    ]


def test_a_vehicle_takes_little_room() -> None:
    assert len(json.dumps(vehicle_rows((FLYING,)), separators=(",", ":"))) < 170


def test_what_another_version_kept_is_understood(store: Store) -> None:
    document = telemetry_document([(1.0, vehicle_rows((FLYING,)))])
    assert telemetry_samples(document) == (TelemetrySample(1.0, (FLYING,)),)
    more = {"columns": ["added", *DIGITS], "samples": [[1.0, [[9, *vehicle_rows((FLYING,))[0]]]]]}
    assert telemetry_samples(more) == telemetry_samples(document)
    (older,) = vehicle_statuses([vehicle_rows((FLYING,))[0][:12]])
    assert (older.system_id, older.yaw_rad, older.battery_fraction, older.heartbeat_s) == (7, -0.512, None, None)
    with pytest.raises(ValueError, match="3 parts"):
        vehicle_statuses([["x"] * 6 + [True, 1, 2, 3, [1.0, 2.0]]])


def test_a_store_that_is_behind_goes_without_it_and_keeps_what_must_be_kept(tmp_path: Path) -> None:
    engine = open_engine(f"sqlite:///{tmp_path / 'slow.sqlite3'}")
    upgrade(engine)
    with closing(StoreJournal(engine, EventTail(), capacity=10)) as journal:
        with engine.connect() as other:
            other.exec_driver_sql("BEGIN IMMEDIATE")  # nobody else can write now
            for index in range(30):
                journal.record_telemetry("c", TelemetrySample(float(index), (FLYING,)))
            health = journal.health()
            assert (health.skipped, health.lost) == (20, 0)
            assert journal.durability()() is False
            other.rollback()
        assert journal.flush(WAIT_S)
        journal.record(Event(31.0, "campaign.state", "flying"))
        journal.record_telemetry("c", TelemetrySample(31.0, (FLYING,)))
        assert journal.flush(WAIT_S)
        assert (journal.health().skipped, journal.health().ok) == (20, True)
    assert [one.time_s for one in Telemetry(engine).times("c")] == [*map(float, range(10)), 31.0]
    engine.dispose()
