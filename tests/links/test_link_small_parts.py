"""Modes, parameters, subscriptions, loss and addresses against pymavlink's own tables and hand calculation."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavutil

from gcs.links.loss import LossMeter
from gcs.links.modes import ARDUPILOT, MODE_PARAMETERS, PX4, describe_mode
from gcs.links.parameters import MAX_REQUESTS, WANTED, ParameterReader, decode_value, limits_from
from gcs.links.subscriptions import STREAM_FALLBACK_AFTER, Subscriptions
from gcs.links.transport import LinkError, open_transport, parse_address
from gcs.ports import FlightMode


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


def test_parameters_are_asked_for_again_and_given_up() -> None:
    reader = ParameterReader()
    asked = [reader.next_request(PX4, 0.5 * tick) for tick in range(200)]
    assert asked.count("MPC_XY_VEL_MAX") == MAX_REQUESTS
    assert set(reader.missing(PX4)) == set(WANTED[PX4])
    assert reader.settled(PX4, 200.0)


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
