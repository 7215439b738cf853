"""Modes, parameters, subscriptions, loss and addresses against pymavlink's own tables and hand calculation."""

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavutil

from gcs.links.loss import LossMeter
from gcs.links.modes import ARDUPILOT, MODE_PARAMETERS, PX4, describe_mode
from gcs.links.parameters import MAX_REQUESTS, WANTED, ParameterReader, decode_value, limits_from
from gcs.links.subscriptions import STREAM_FALLBACK_AFTER, Subscriptions
from gcs.links.transport import LinkError, open_transport, parse_address
from gcs.ports import FlightMode, VehicleLimits
from sitl_mock.physics import layout
from sitl_mock.physics.fleet import STEP_TICKS, Fleet
from sitl_mock.physics.vehicle import ARDUQUAD


def test_ardupilot_names_agree_with_pymavlink() -> None:
    for number, name in mavutil.mode_mapping_acm.items():
        ours, _ = describe_mode(ARDUPILOT, number)
        assert ours in {name, f"MODE {number}"}
    guided = {name: number for number, name in mavutil.mode_mapping_acm.items()}["GUIDED"]
    assert MODE_PARAMETERS[ARDUPILOT][FlightMode.GUIDED][0] == guided


def test_px4_modes_agree_with_pymavlink() -> None:
    offboard = mavutil.px4_map["OFFBOARD"]
    assert MODE_PARAMETERS[PX4][FlightMode.GUIDED] == (float(offboard[1]), float(offboard[2]))
    assert describe_mode(PX4, offboard[1] << 16)[1] is FlightMode.GUIDED
    rtl = mavutil.px4_map["RTL"]
    assert describe_mode(PX4, (rtl[1] << 16) | (rtl[2] << 24)) == ("AUTO.RTL", FlightMode.RETURN)


def test_an_unknown_mode_belongs_to_the_pilot() -> None:
    assert describe_mode(PX4, 99 << 16)[1] is FlightMode.PILOT
    assert describe_mode(ARDUPILOT, 1234)[1] is FlightMode.PILOT


def test_integer_parameters_by_bytes_and_by_cast() -> None:
    as_bytes = struct.unpack("<f", struct.pack("<i", -7))[0]
    assert decode_value(as_bytes, 6, bytewise=True) == -7.0
    assert decode_value(4500.0, 4, bytewise=False) == 4500.0


def test_limits_by_hand() -> None:
    copter = limits_from(ARDUPILOT, {"WPNAV_ACCEL": 250.0, "ANGLE_MAX": 4500.0, "GUID_TIMEOUT": 3.0})
    assert copter.max_accel_mps2 == pytest.approx(2.5)
    assert copter.setpoint_timeout_s == 3.0
    flat = limits_from(ARDUPILOT, {"WPNAV_ACCEL": 900.0, "ANGLE_MAX": 2500.0})
    assert flat.max_accel_mps2 == pytest.approx(4.573, abs=1e-3)  # g tan 25 degrees
    px4 = limits_from(PX4, {"MPC_XY_VEL_MAX": 12.0, "MPC_ACC_HOR": 6.0, "MPC_TILTMAX_AIR": 25.0})
    assert px4.max_accel_mps2 == pytest.approx(4.573, abs=1e-3)
    px4 = limits_from(PX4, {"MPC_XY_VEL_MAX": 12.0, "MPC_ACC_HOR": 3.0})
    assert (px4.max_speed_mps, px4.max_accel_mps2) == (12.0, 3.0)


@pytest.mark.parametrize("nonsense", [math.nan, math.inf, 0.0, -1.0])
def test_a_limit_that_is_no_number_is_not_known(nonsense: float) -> None:
    """min(inf, nan) is inf: the gate would have counted on braking at once."""
    px4 = limits_from(PX4, {"MPC_XY_VEL_MAX": nonsense, "MPC_ACC_HOR": nonsense, "COM_OF_LOSS_T": nonsense})
    copter = limits_from(ARDUPILOT, {"WPNAV_ACCEL": nonsense, "ANGLE_MAX": nonsense, "GUID_TIMEOUT": nonsense})
    assert px4 == copter == VehicleLimits()


def test_parameters_are_asked_for_again_and_given_up() -> None:
    reader = ParameterReader()
    asked = [reader.next_request(PX4, 0.5 * tick) for tick in range(200)]
    assert asked.count("MPC_XY_VEL_MAX") == MAX_REQUESTS
    assert set(reader.missing(PX4)) == set(WANTED[PX4])
    assert reader.settled(PX4, 200.0)


def copter_mps(lean_cdeg: float, **drag: float) -> float | None:
    return limits_from(ARDUPILOT, {"ANGLE_MAX": lean_cdeg, **drag}).max_speed_mps


def test_a_copters_top_speed_by_lean_and_drag() -> None:
    """At that speed the estimator's drag takes nine tenths of g tan(lean), whichever way the vehicle faces."""
    accel_mps2 = 0.9 * 9.80665 * 0.57735  # tan 30 degrees
    assert copter_mps(3000.0, EK3_DRAG_MCOEF=0.2) == pytest.approx(accel_mps2 / 0.2, rel=1e-4)
    speed_mps = copter_mps(3000.0, EK3_DRAG_MCOEF=0.2, EK3_DRAG_BCOEF_X=30.0, EK3_DRAG_BCOEF_Y=20.0)
    assert speed_mps is not None
    assert 0.2 * speed_mps + 0.5 * 1.225 * speed_mps**2 / 20.0 == pytest.approx(accel_mps2, rel=1e-4)
    assert copter_mps(4500.0, EK3_DRAG_BCOEF_X=30.0) == pytest.approx((0.9 * 9.80665 * 60.0 / 1.225) ** 0.5)


@pytest.mark.parametrize(
    "values", [{"ANGLE_MAX": 3000.0}, {"EK3_DRAG_MCOEF": 0.2}, {"ANGLE_MAX": 3000.0, "EK3_DRAG_MCOEF": 0.0}]
)
def test_a_copter_without_drag_or_lean_has_no_known_top_speed(values: dict[str, float]) -> None:
    assert limits_from(ARDUPILOT, {**values, "WPNAV_SPEED": 1000.0, "LOIT_SPEED": 1250.0}).max_speed_mps is None


@pytest.mark.parametrize("names", [("WPNAV_ACCEL", "ANGLE_MAX"), ("WP_ACC", "ATC_ANGLE_MAX")])
def test_a_vehicle_of_either_naming_is_understood(names: tuple[str, str]) -> None:
    """ArduCopter 4.7 knows the new names only, in m/s^2 and degrees; the older ones cm/s^2 and centidegrees."""
    answers = {"WPNAV_ACCEL": 250.0, "ANGLE_MAX": 4500.0, "WP_ACC": 2.5, "ATC_ANGLE_MAX": 45.0}
    reader, now_s = ParameterReader(), 0.0
    while not reader.settled(ARDUPILOT, now_s):
        now_s += 0.5
        asked = reader.next_request(ARDUPILOT, now_s)
        if asked in names:
            assert reader.on_value(asked, answers[asked])
    assert reader.values == {"WPNAV_ACCEL": 250.0, "ANGLE_MAX": 4500.0}
    assert limits_from(ARDUPILOT, reader.values).max_accel_mps2 == pytest.approx(2.5)


def test_rates_are_asked_for_until_seen() -> None:
    subscriptions = Subscriptions()
    first, _ = subscriptions.due(PX4, 0.0)
    assert (33, 10.0) in first
    for tick in range(1, 40):
        subscriptions.on_message("GLOBAL_POSITION_INT", 0.1 * tick)
    later, _ = subscriptions.due(PX4, 4.0)
    assert 33 not in {number for number, _ in later}
    assert 30 in {number for number, _ in later}


def test_ardupilot_falls_back_to_data_streams() -> None:
    subscriptions = Subscriptions()
    fallbacks = [subscriptions.due(ARDUPILOT, float(second))[1] for second in range(6)]
    assert fallbacks[:STREAM_FALLBACK_AFTER] == [False] * STREAM_FALLBACK_AFTER
    assert fallbacks[-1]


@given(st.integers(0, 255))
def test_no_loss_in_an_unbroken_count(start: int) -> None:
    meter = LossMeter()
    for step in range(600):
        meter.on_sequence((start + step) % 256)
    assert meter.ratio == 0.0


def test_every_second_message_lost_is_a_half() -> None:
    meter = LossMeter()
    for step in range(0, 2000, 2):
        meter.on_sequence(step % 256)
    assert meter.ratio == pytest.approx(0.5, abs=0.02)


def test_repeats_and_reordering_are_not_loss() -> None:
    meter = LossMeter()
    for step in range(100):
        meter.on_sequence(step)
        meter.on_sequence(step)
    assert meter.ratio == 0.0


@pytest.mark.parametrize(
    "text",
    [
        "",
        "udpout:x",
        "serial:/dev/x:1",
        "serial:/dev/x:y",
        "usb:/dev/x:1",
        "udpin::5",
        "udpin:h:0",
        "tcp:h:70000",
        "udpin:h:a",
    ],
)
def test_bad_addresses_say_how_to_write_one(text: str) -> None:
    with pytest.raises(LinkError, match=r"write"):
        parse_address(text)


def test_a_taken_port_is_one_clear_line() -> None:
    first = open_transport("udpin:127.0.0.1:24551")
    try:
        with pytest.raises(LinkError, match="another port"):
            open_transport("udpin:127.0.0.1:24551")
    finally:
        first.close()


def test_that_top_speed_is_less_than_what_the_mocks_physics_reach() -> None:
    """A second account of drag: the quad of the flight logs, told to fly faster than it can lean for."""
    fleet = Fleet([ARDUQUAD])
    fleet.place(np.array([[0.0, 0.0, -100.0]]), np.zeros((1, 3)))
    fleet.command[0, :2] = 30.0, 0.0
    fleet.command[0, layout.CMD_MOTORS] = 1.0
    fleet.advance(60 * STEP_TICKS * 10)
    ballistic_kgpm2 = 0.5 * 1.225 / ARDUQUAD.drag_quadratic_1pm
    told_mps = copter_mps(3000.0, EK3_DRAG_MCOEF=ARDUQUAD.drag_linear_1ps, EK3_DRAG_BCOEF_X=ballistic_kgpm2)
    assert told_mps is not None
    assert 0.85 < told_mps / float(np.hypot(*fleet.vel_ned_mps[0, :2])) < 1.0
