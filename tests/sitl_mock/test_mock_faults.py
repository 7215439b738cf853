"""Faults add up while they overlap, strike the vehicle meant, and show on the wire as they would on a real one."""

from __future__ import annotations

from itertools import pairwise
from math import radians

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_station import ARM, MODE, Station, fly, station

from sitl_mock.autopilot.core import BOOT_S
from sitl_mock.faults import KINDS, Effects, Fault, FaultError, Script, parse
from sitl_mock.link import Quality

LASTING = sorted(name for name, kind in KINDS.items() if kind.add is not None)
_times = st.floats(0, 10).map(lambda value: round(value, 1))


@given(st.lists(st.tuples(st.sampled_from(LASTING), _times, _times.filter(bool)), max_size=6), _times)
def test_effects_are_those_of_the_faults_that_are_on(spans: list[tuple[str, float, float]], now_s: float) -> None:
    """However they overlap, at any time the script agrees with a sum over the faults that are on then."""
    faults = [
        Fault(kind, 0, at_s, for_s, 0.5 if KINDS[kind].high == 1.0 else 1.0, text="X") for kind, at_s, for_s in spans
    ]
    script = Script(faults, 1)
    last = Effects()
    for tenth in range(round(now_s * 10) + 1):
        for change in script.advance(tenth / 10):
            last = change.effects
    expected = Effects()
    for fault in faults:
        add = KINDS[fault.kind].add
        if add is not None and fault.at_s <= now_s + 1e-9 < fault.at_s + fault.for_s:
            add(expected, fault)
    assert last.gps_lost == expected.gps_lost
    assert last.motors_out == expected.motors_out
    for name in Quality.__slots__:
        assert getattr(last.up, name) == pytest.approx(getattr(expected.up, name))


def test_the_end_of_one_leaves_the_other() -> None:
    script = Script([Fault("gps_loss", at_s=1.0, for_s=2.0), Fault("gps_loss", at_s=2.0, for_s=5.0)], 2)
    lost = [change.effects.gps_lost for now_s in (1.0, 3.0, 7.0) for change in script.advance(now_s)]
    assert lost == [True, True, True, True, False, False]


def test_faults_can_be_added_and_taken_off_while_it_runs() -> None:
    script = Script([], 1)
    number = script.add(Fault("loss", value=0.5))
    (change,) = script.advance(0.0)
    assert change.effects.up.loss == 0.5
    assert script.faults == {number: (Fault("loss", value=0.5), True)}
    assert script.remove(number)
    assert not script.remove(number)
    (change,) = script.advance(0.02)
    assert change.effects == Effects()


def test_only_the_vehicle_meant_suffers() -> None:
    ground = station("ardupilot", count=2, faults=[Fault("compass_error", vehicle=2, value=40.0)])
    ground.run(1.0)
    first, second = ground.simulation.autopilots
    assert first.vehicle.body.yaw_rad == 0.0
    assert second.vehicle.body.yaw_rad == pytest.approx(radians(40.0))


def _north_m(ground: Station) -> float:
    return (ground.last("GLOBAL_POSITION_INT").lat - 404258000) * 0.0111


def test_gps_glitch_is_doubted_then_believed() -> None:
    ground = station("ardupilot", faults=[Fault("gps_glitch", at_s=40.0, for_s=20.0, value=60.0)])
    ground.command(511, 33, 1e5)
    ground.command(511, 24, 1e5)
    fly(ground)
    ground.run(45.0 - ground.now_s)
    assert "GPS Glitch or Compass error" in ground.texts()
    assert ground.last("GPS_RAW_INT").lat - 404258000 == pytest.approx(60 / 0.0111, rel=0.02)
    assert _north_m(ground) == pytest.approx(0.0, abs=1.0)
    ground.run(4.0)  # believed after 7 s: the vehicle now thinks that it is 60 m too far north, and flies back
    assert "Glitch cleared" in ground.texts()
    ground.run(10.0)
    assert ground.vehicle.body.true_ned_m[0] < -20.0


def test_gps_noise_wanders_slowly() -> None:
    ground = station("px4", gps_noise_m=2.0, seed=4)
    wander = []
    for _ in range(600):
        ground.run(1.0)
        wander.append(ground.vehicle.body.position.error_ned_m[0])
    steps = [abs(b - a) for a, b in pairwise(wander)]
    assert 0.8 < (sum(value * value for value in wander) / len(wander)) ** 0.5 < 4.0
    assert max(steps) < 2.0


def test_receiver_reports_late() -> None:
    ground = station("ardupilot", gps_delay_s=0.4)
    fly(ground)
    ground.run(10.0, every_s=0.1, do=lambda: ground.velocity(10, 0))
    ground.command(512, 24)
    ground.command(512, 33)
    behind = ground.last("GLOBAL_POSITION_INT").lat - ground.last("GPS_RAW_INT").lat
    assert behind * 0.0111 == pytest.approx(4.0 + 1.0, abs=2.0)  # 0.4 s, and the command in between


def test_compass_error_forbids_arming_and_shows() -> None:
    ground = station("ardupilot", faults=[Fault("compass_error", value=45.0, for_s=10.0)])
    ground.run(3.0)
    ground.command(MODE, 1, 4)
    assert ground.command(ARM, 1) == 4
    assert "Arm: Compass not healthy" in ground.texts()
    ground.command(512, 193)
    assert ground.last("EKF_STATUS_REPORT").compass_variance > 1.0


@pytest.mark.parametrize(("motors", "stays"), [(1, True), (2, False)])
def test_a_hexarotor_survives_one_motor(motors: int, stays: bool) -> None:
    ground = station("ardupilot", faults=[Fault("motor_out", at_s=40.0, value=motors)])
    fly(ground)
    ground.run(50.0 - ground.now_s)
    assert any("Potential Thrust Loss" in text for text in ground.texts())
    assert (ground.vehicle.alt_home_m > 25.0) == stays


def test_cell_failure_drops_the_voltage_by_a_cell() -> None:
    ground = station("ardupilot", faults=[Fault("cell_failure", at_s=3.0, value=1.0)])
    ground.command(512, 147)
    good = ground.last("BATTERY_STATUS").voltages
    ground.run(4.0)
    ground.command(512, 147)
    bad = ground.last("BATTERY_STATUS").voltages
    assert [abs(a - b) > 1000 for a, b in zip(good[:6], bad[:6], strict=True)] == [False] * 5 + [True]


def test_reboot_in_flight_falls_and_comes_back() -> None:
    ground = station("ardupilot", faults=[Fault("reboot", at_s=40.0)])
    ground.vehicle.params.set("RTL_ALT", 2222)
    fly(ground)
    ground.run(40.0 - ground.now_s)
    silent = ground.run(BOOT_S - 0.1)
    assert all(message.get_type() != "HEARTBEAT" for message in silent)
    ground.run(5.0)
    assert not ground.vehicle.armed
    assert ground.vehicle.body.on_ground
    assert ground.vehicle.params["RTL_ALT"] == 2222
    ground.command(512, 2)
    assert ground.last("SYSTEM_TIME").time_boot_ms == pytest.approx(7100, abs=200)


def test_reboot_command_is_refused_while_armed() -> None:
    ground = station("ardupilot")
    ground.run(2.5)
    assert ground.command(246, 1) == 0
    ground.run(BOOT_S + 2.5)
    ground.command(512, 2)
    assert ground.last("SYSTEM_TIME").time_boot_ms < 5000
    ground.command(MODE, 1, 4)
    assert ground.command(ARM, 1) == 0
    assert ground.command(246, 1) == 4


def test_clock_drift_shows_in_every_time_stamp() -> None:
    ground = station("ardupilot", faults=[Fault("clock_drift", value=0.1, for_s=20.0)])
    ground.run(30.0)
    ground.command(512, 2)
    assert ground.last("SYSTEM_TIME").time_boot_ms == pytest.approx(32_000, abs=200)


def test_corrupted_frames_do_nothing() -> None:
    """Neither end takes a frame whose checksum is wrong: 300 setpoints garbled on the way up change nothing."""
    ground = station("ardupilot", faults=[Fault("corrupt", at_s=30.0, value=1.0, direction="up")])
    fly(ground)
    ground.run(31.0 - ground.now_s)
    for _ in range(300):
        ground.velocity(15, 0)
    ground.run(5.0)
    assert abs(ground.vehicle.body.vel_ned_mps[0]) < 0.1


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ({"kind": "motor_out", "value": 1.5}, "whole number"),
        ({"kind": "compass_error", "value": 500}, "value = 500"),
        ({"kind": "cut", "vehicle": True}, "vehicle = True"),
        ({"kind": 3}, "no text"),
        ([], "no table"),
    ],
)
def test_bad_faults_say_so(row: object, says: str) -> None:
    with pytest.raises(FaultError, match=says):
        parse(row, vehicles=2, modes=())


def test_defaults_of_kinds_are_valid() -> None:
    for name, kind in KINDS.items():
        fault = parse({"kind": name, "text": "X"}, vehicles=1, modes=("X",))
        assert fault.value == kind.default


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(sorted(KINDS)), st.floats(0, 30), st.floats(0.1, 20)), max_size=5))
def test_no_mixture_of_faults_breaks_the_mock(mixture: list[tuple[str, float, float]]) -> None:
    faults = []
    for kind, at_s, for_s in mixture:
        value = KINDS[kind].default or (0.5 if KINDS[kind].high == 1.0 else 0.1)
        faults.append(Fault(kind, 0, at_s, for_s, value, text="LOITER"))
    ground = station("ardupilot", faults=faults)
    ground.run(50.0, every_s=0.1, do=lambda: ground.velocity(5, 5))
    state = ground.vehicle.body.true_ned_m + ground.vehicle.body.vel_ned_mps
    assert all(abs(value) < 1e4 for value in state)
