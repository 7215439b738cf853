"""Velocity streams: what is followed, what is ignored, and what follows when they stop."""

from __future__ import annotations

from math import hypot, inf, nan, radians

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_station import MODE, TAKEOFF, VELOCITY_YAW, Station, fly, mav, station

GUIDED, OFFBOARD = 4, 6


def offboard(ground: Station) -> None:
    ground.run(1.2, every_s=0.1, do=lambda: ground.velocity(0, 0))
    assert ground.command(MODE, 1, OFFBOARD) == 0


def speed(ground: Station) -> float:
    return hypot(*ground.vehicle.body.vel_ned_mps[:2])


def test_px4_offboard_needs_a_stream_first() -> None:
    ground = station("px4")
    fly(ground)
    assert ground.command(MODE, 1, OFFBOARD) == mav.MAV_RESULT_TEMPORARILY_REJECTED
    ground.run(0.8, every_s=0.1, do=lambda: ground.velocity(0, 0))
    assert ground.command(MODE, 1, OFFBOARD) == mav.MAV_RESULT_TEMPORARILY_REJECTED  # not a second yet
    ground.run(4.0, every_s=0.7, do=lambda: ground.velocity(0, 0))
    assert ground.command(MODE, 1, OFFBOARD) == mav.MAV_RESULT_TEMPORARILY_REJECTED  # 1.4 Hz is too slow
    offboard(ground)


def test_px4_leaves_offboard_1_s_after_the_last_setpoint() -> None:
    ground = station("px4")
    fly(ground)
    offboard(ground)
    ground.run(6.0, every_s=0.1, do=lambda: ground.velocity(15, 0))
    last_s = ground.now_s - 0.1
    ground.run_until(lambda: ground.vehicle.mode.name == "POSCTL", 3.0)
    assert ground.now_s - last_s == pytest.approx(1.0, abs=0.15)
    ground.run(10.0)
    assert speed(ground) < 0.2


def test_px4_com_obl_rc_act_says_what_follows() -> None:
    ground = station("px4")
    fly(ground)
    ground.vehicle.params.set("COM_OBL_RC_ACT", 3)
    offboard(ground)
    ground.run(1.5)
    assert ground.vehicle.mode.name == "AUTO.RTL"


def test_ardupilot_brakes_3_s_after_the_last_setpoint_and_stays_guided() -> None:
    ground = station("ardupilot")
    fly(ground)
    ground.run(10.0, every_s=0.1, do=lambda: ground.velocity(18, 0))
    texts = len(ground.texts())
    ground.run(2.8)
    assert speed(ground) == pytest.approx(18.0, abs=0.2)
    ground.run(0.8)
    assert speed(ground) < 17.0
    ground.run(10.0)
    assert speed(ground) < 0.2
    assert ground.vehicle.mode.name == "GUIDED"
    assert len(ground.texts()) == texts  # without a word


def test_half_a_hertz_still_holds_the_speed_on_ardupilot() -> None:
    ground = station("ardupilot")
    fly(ground)
    ground.run(20.0, every_s=2.0, do=lambda: ground.velocity(10, 0))
    assert speed(ground) == pytest.approx(10.0, abs=0.2)


def test_a_setpoint_during_takeoff_cancels_the_climb_on_ardupilot() -> None:
    ground = station("ardupilot")
    ground.run(2.5)
    ground.command(MODE, 1, GUIDED)
    ground.command(400, 1)
    ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 30)
    ground.run_until(lambda: ground.vehicle.alt_home_m > 10.0, 20.0)
    ground.velocity(2, 0)
    ground.run(10.0)
    assert 10.0 < ground.vehicle.alt_home_m < 18.0  # stops the 5 m/s climb, far under the 30 m asked for


def test_setpoints_on_the_ground_are_ignored_without_a_word() -> None:
    ground = station("ardupilot")
    ground.run(2.5)
    ground.command(MODE, 1, GUIDED)
    ground.command(400, 1)
    heard = len(ground.heard)
    ground.run(2.0, every_s=0.1, do=lambda: ground.velocity(5, 0, -2))
    assert not ground.vehicle.flying
    assert {m.get_type() for m in ground.heard[heard:]} <= {"HEARTBEAT", "TIMESYNC"}


@pytest.mark.parametrize("bad", [nan, inf])
def test_no_number_stops_ardupilot(bad: float) -> None:
    ground = station("ardupilot")
    fly(ground)
    ground.run(6.0, every_s=0.1, do=lambda: ground.velocity(10, 0))
    ground.velocity(bad, 0)
    ground.run(2.5)
    assert speed(ground) < 3.0


def test_yaw_is_followed_and_body_frame_turns_with_it() -> None:
    ground = station("ardupilot")
    fly(ground)
    ground.run(4.0, every_s=0.1, do=lambda: ground.velocity(0, 0, mask=VELOCITY_YAW, yaw=radians(90)))
    assert ground.vehicle.body.yaw_rad == pytest.approx(radians(90), abs=0.02)
    body = mav.MAVLink_set_position_target_local_ned_message(0, 1, 1, 8, 3527, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0)
    ground.run(6.0, every_s=0.1, do=lambda: ground.send(body))
    assert ground.vehicle.body.vel_ned_mps == pytest.approx((0.0, 5.0, 0.0), abs=0.1)


def test_local_ned_velocity_and_position_echo() -> None:
    ground = station("ardupilot")
    fly(ground)
    local = mav.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 3527, 0, 0, 0, -4, 3, 0, 0, 0, 0, 0, 0)
    ground.run(5.0, every_s=0.1, do=lambda: ground.send(local))
    assert ground.vehicle.body.vel_ned_mps == pytest.approx((-4.0, 3.0, 0.0), abs=0.1)
    assert ground.command(512, mav.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT) == 0
    echo = ground.last("POSITION_TARGET_GLOBAL_INT")
    assert (echo.type_mask, echo.vx, echo.vy) == (3527, -4.0, 3.0)


def test_position_target_is_flown_to_and_held() -> None:
    ground = station("ardupilot")
    fly(ground)
    place = mav.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 3576, 40, -30, -35, 0, 0, 0, 0, 0, 0, 0, 0)
    ground.send(place)
    ground.run(25.0)
    assert ground.vehicle.body.pos_ned_m == pytest.approx((40.0, -30.0, -35.0), abs=0.3)


def test_px4_truncates_at_mpc_xy_vel_max() -> None:
    ground = station("px4")
    fly(ground)
    ground.send(mav.MAVLink_param_set_message(1, 1, b"MPC_XY_VEL_MAX", 12.0, 9))
    offboard(ground)
    ground.run(10.0, every_s=0.1, do=lambda: ground.velocity(18, 0))
    assert speed(ground) == pytest.approx(12.0, abs=0.1)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 65535),
    st.integers(0, 255),
    st.lists(st.floats(width=32), min_size=11, max_size=11),
    st.sampled_from(["ardupilot", "px4"]),
)
def test_no_setpoint_can_make_the_state_meaningless(mask: int, frame: int, values: list[float], flavour: str) -> None:
    ground = station(flavour)
    fly(ground, 5.0)
    if flavour == "px4":
        offboard(ground)
    ground.send(mav.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *values))
    ground.run(1.0)
    assert all(abs(value) < 1e6 for value in (*ground.vehicle.body.pos_ned_m, *ground.vehicle.body.vel_ned_mps))
