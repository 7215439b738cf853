"""Telemetry rates, parameters, time, addresses: the services around the flight."""

from __future__ import annotations

import io
from collections import Counter
from math import inf, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_station import ARM, MODE, fly, mav, station

from sitl_mock.autopilot.constants import Command
from sitl_mock.autopilot.parameters import Encoding, ParamType, from_wire
from sitl_mock.physics import layout
from sitl_mock.wire import encode
from sitl_mock.wire.definition import BY_ID
from sitl_mock.wire.frame import unpack_payload

_HARD = st.sampled_from([nan, inf, -inf, 3e38, -3e38, 0.0, 1.0, -1.0, 4.0, 40.0, 1e9])
SET_INTERVAL, GET_INTERVAL, REQUEST = 511, 510, 512


def _counts(messages: list[object]) -> Counter[str]:
    return Counter(message.get_type() for message in messages)  # type: ignore[attr-defined]


def test_ardupilot_sends_only_heartbeat_and_timesync_until_asked() -> None:
    ground = station("ardupilot")
    counts = _counts(ground.run(30.0))
    assert set(counts) == {"HEARTBEAT", "TIMESYNC", "STATUSTEXT"}
    assert counts["HEARTBEAT"] in {30, 31}


def test_px4_has_its_default_set() -> None:
    ground = station("px4")
    early = _counts(ground.run(1.9))
    assert "GLOBAL_POSITION_INT" not in early  # nothing is published before it is valid
    ground.run(0.2)
    counts = _counts(ground.run(20.0))
    assert counts["ATTITUDE"] == pytest.approx(300, abs=40)
    assert counts["GLOBAL_POSITION_INT"] == pytest.approx(100, abs=3)
    assert "EKF_STATUS_REPORT" not in counts
    assert counts["ESTIMATOR_STATUS"] == pytest.approx(10, abs=1)


@pytest.mark.parametrize(("rate_hz", "expected"), [(10.0, 100), (4.0, 40), (1000.0, 500)])
def test_message_interval_sets_the_average_rate(rate_hz: float, expected: int) -> None:
    ground = station("ardupilot")
    assert ground.command(SET_INTERVAL, 33, 1e6 / rate_hz) == 0
    assert _counts(ground.run(10.0))["GLOBAL_POSITION_INT"] == pytest.approx(expected, abs=2)
    assert ground.command(GET_INTERVAL, 33) == 0
    assert ground.last("MESSAGE_INTERVAL").interval_us == pytest.approx(max(1e6 / rate_hz, 2e4))
    assert ground.command(SET_INTERVAL, 33, -1) == 0
    assert _counts(ground.run(5.0))["GLOBAL_POSITION_INT"] == 0


@pytest.mark.parametrize(("flavour", "verdict"), [("ardupilot", 4), ("px4", 2)])
def test_unknown_messages_are_refused(flavour: str, verdict: int) -> None:
    ground = station(flavour)
    assert ground.command(SET_INTERVAL, 9999, 1e6) == 2
    assert ground.command(REQUEST, 9999) == verdict


def test_data_stream_request_turns_groups_on() -> None:
    ground = station("ardupilot")
    ground.send(mav.MAVLink_request_data_stream_message(1, 1, 6, 5, 1))
    counts = _counts(ground.run(4.0))
    assert counts["GLOBAL_POSITION_INT"] == pytest.approx(20, abs=1)
    assert "ATTITUDE" not in counts
    ground.send(mav.MAVLink_request_data_stream_message(1, 1, 0, 2, 1))
    assert {"ATTITUDE", "VFR_HUD", "SYS_STATUS", "BATTERY_STATUS", "EKF_STATUS_REPORT"} <= set(_counts(ground.run(2.0)))


def test_telemetry_agrees_with_the_physics() -> None:
    ground = station("ardupilot")
    fly(ground)
    ground.run(10.0, every_s=0.1, do=lambda: ground.velocity(6, -8))
    for number in (33, 32, 30, 74, 1, 147, 24, 242, 245, 193):
        assert ground.command(REQUEST, number) == 0
    vel = ground.vehicle.body.vel_ned_mps
    position = ground.last("GLOBAL_POSITION_INT")
    assert (position.vx, position.vy) == pytest.approx((600, -800), abs=15)
    assert position.relative_alt == pytest.approx(30_000, abs=500)
    assert position.alt - position.relative_alt == pytest.approx(186_000, abs=2)
    assert position.lat > 404258000
    assert position.lon < -869197000
    assert ground.last("VFR_HUD").groundspeed == pytest.approx(10.0, abs=0.1)
    assert ground.last("ATTITUDE").pitch < 0 < abs(ground.last("ATTITUDE").roll)
    assert ground.last("LOCAL_POSITION_NED").vx == pytest.approx(vel[0], abs=0.2)
    used_j = float(ground.vehicle.body._column[layout.USED_J])
    assert ground.last("BATTERY_STATUS").current_consumed == pytest.approx(used_j / 22.2 / 3.6, abs=1)
    assert ground.last("SYS_STATUS").battery_remaining == pytest.approx(100 * (1 - used_j / 359_640), abs=1)
    assert ground.last("EXTENDED_SYS_STATE").landed_state == mav.MAV_LANDED_STATE_IN_AIR
    assert ground.last("EKF_STATUS_REPORT").flags == 831
    assert ground.last("GPS_RAW_INT").fix_type == 6
    assert ground.last("HOME_POSITION").latitude == 404258000


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_parameters_are_listed_whole_and_read_by_name_and_index(flavour: str) -> None:
    ground = station(flavour)
    ground.send(mav.MAVLink_param_request_list_message(1, 1))
    values = [m for m in ground.run(3.0) if m.get_type() == "PARAM_VALUE"]
    assert [m.param_index for m in values] == list(range(values[0].param_count))
    name = "ANGLE_MAX" if flavour == "ardupilot" else "MPC_XY_VEL_MAX"
    index = next(m.param_index for m in values if m.param_id == name)
    for text, number in ((name.encode(), -1), (b"", index)):
        ground.send(mav.MAVLink_param_request_read_message(1, 1, text, number))
        (read,) = [m for m in ground.run(0.1) if m.get_type() == "PARAM_VALUE"]
        assert read.param_id == name
        assert read.param_value == (2500.0 if flavour == "ardupilot" else 18.0)


def test_integers_travel_as_bytes_on_px4_and_cast_on_ardupilot() -> None:
    px4 = station("px4")
    px4.send(mav.MAVLink_param_request_read_message(1, 1, b"COM_DL_LOSS_T", -1))
    px4.run(0.1)
    value = px4.last("PARAM_VALUE")
    raw = bytes(value.pack(mav.MAVLink(io.BytesIO(), srcSystem=1)))[10:14]
    assert int.from_bytes(raw, "little") == 10
    assert value.param_type == mav.MAV_PARAM_TYPE_INT32
    ardupilot = station("ardupilot")
    ardupilot.send(mav.MAVLink_param_set_message(1, 1, b"SYSID_MYGCS", 245, 4))
    ardupilot.run(0.1)
    assert ardupilot.last("PARAM_VALUE").param_value == 245.0
    for ground, bit in ((px4, 16), (ardupilot, 131072)):
        ground.command(REQUEST, 148)
        assert ground.last("AUTOPILOT_VERSION").capabilities & (16 | 131072) == bit


def test_bad_parameter_values_change_nothing() -> None:
    ground = station("ardupilot")
    ground.send(mav.MAVLink_param_set_message(1, 1, b"ANGLE_MAX", nan, 4))
    ground.send(mav.MAVLink_param_set_message(1, 1, b"ANGLE_MAX", 1e9, 4))
    ground.send(mav.MAVLink_param_set_message(1, 1, b"NO_SUCH", 1, 4))
    ground.run(0.1)
    assert ground.vehicle.params["ANGLE_MAX"] == 2500.0
    assert from_wire(nan, ParamType.REAL32, Encoding.BYTEWISE) is None


def test_lean_and_acceleration_parameters_change_the_flight() -> None:
    ground = station("ardupilot")
    ground.send(mav.MAVLink_param_set_message(1, 1, b"WPNAV_ACCEL", 100, 9))
    fly(ground)
    ground.run(4.0, every_s=0.1, do=lambda: ground.velocity(18, 0))
    assert ground.vehicle.body.vel_ned_mps[0] < 4.5


def test_timesync_and_ping_are_answered_to_the_asker() -> None:
    ground = station("ardupilot")
    ground.run(1.0)
    ground.send(mav.MAVLink_timesync_message(0, 123456789))
    ground.send(mav.MAVLink_ping_message(5, 77, 0, 0))
    ground.run(0.1)
    assert ground.last("TIMESYNC").ts1 == 123456789
    assert ground.last("TIMESYNC").tc1 == pytest.approx(1e9, abs=1e8)
    ping = ground.last("PING")
    assert (ping.seq, ping.target_system, ping.target_component) == (77, 245, 190)


def test_mode_change_acknowledges_before_it_speaks() -> None:
    ground = station("ardupilot", ready_after_s=30.0)
    ground.command(MODE, 1, 4)
    before = len(ground.heard)
    ground.command(ARM, 1)
    kinds = [m.get_type() for m in ground.heard[before:] if m.get_type() in {"COMMAND_ACK", "STATUSTEXT"}]
    assert kinds == ["COMMAND_ACK", "STATUSTEXT"]


@settings(max_examples=200, deadline=None)
@given(st.data(), st.sampled_from(sorted(BY_ID)), st.sampled_from(["ardupilot", "px4"]), st.booleans())
def test_no_well_framed_rubbish_crashes_the_autopilot(
    data: st.DataObject, msg_id: int, flavour: str, airborne: bool
) -> None:
    """Right checksum, meaningless content: every message of the table, addressed to the vehicle."""
    ground = station(flavour)
    if airborne:
        fly(ground, 3.0)
    definition = BY_ID[msg_id]
    payload = data.draw(st.binary(min_size=definition.size, max_size=definition.size))
    values = unpack_payload(definition, payload)
    for part in definition.fields:
        if part.code == "f" and not part.length:
            values[part.name] = data.draw(_HARD | st.just(values[part.name]))
    values |= {"target_system": 1, "target_component": 1}
    if "command" in values:
        values["command"] = data.draw(st.sampled_from([*Command, values["command"]]))
    ground.simulation.receive(0, 1, encode(definition.name, values, system=245, component=190, seq=0))
    ground.run(0.3)
    for number in (33, 32, 74, 87, 85, 242):
        ground.command(REQUEST, number)
    ground.run(2.5)  # a reboot is over by then
    ground.send(mav.MAVLink_timesync_message(0, 5))  # unanswered if the rubbish was a signing key
    assert {"HEARTBEAT", "TIMESYNC"} & set(_counts(ground.run(1.2)))
