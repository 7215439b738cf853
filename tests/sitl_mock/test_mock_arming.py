"""Arming, modes and takeoff: the verdicts that the real ones give (docs/mock.md)."""

from __future__ import annotations

import pytest
from mock_station import ARM, LAND, MODE, RTL, TAKEOFF, Station, fly, mav, station

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
FORCE = 21196


def test_ardupilot_is_ready_after_41_s_and_says_so() -> None:
    ground = station("ardupilot", ready_after_s=None)
    ground.run(1.0)
    assert ground.command(MODE, 1, 4) == ACCEPTED
    assert ground.command(ARM, 1) == FAILED
    assert any(text.startswith("Arm: ") for text in ground.texts())
    ground.run_until(lambda: "EKF3 IMU0 is using GPS" in ground.texts(), 60.0)
    assert ground.now_s == pytest.approx(41.0, abs=0.1)
    assert ground.command(ARM, 1) == ACCEPTED
    assert ground.command(ARM, 1) == ACCEPTED  # again: no complaint


def test_ardupilot_arms_in_stabilize_before_the_position_is_good() -> None:
    ground = station("ardupilot", ready_after_s=None)
    ground.run(22.0)
    assert ground.command(ARM, 1) == FAILED
    ground.run(1.5)
    assert ground.command(ARM, 1) == ACCEPTED
    assert ground.command(MODE, 1, 4) == FAILED  # GUIDED needs the position


def test_px4_refuses_for_now_with_a_reason() -> None:
    ground = station("px4", ready_after_s=None)
    ground.run(1.0)
    assert ground.command(ARM, 1) == REJECTED
    assert any("Arming denied" in text for text in ground.texts())
    ground.run(10.0)
    assert ground.command(ARM, 1) == ACCEPTED


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_idle_on_the_ground_disarms_after_10_s(flavour: str) -> None:
    ground = station(flavour)
    ground.run(2.5)
    if flavour == "ardupilot":
        ground.command(MODE, 1, 4)
    assert ground.command(ARM, 1) == ACCEPTED
    waited_s = ground.run_until(lambda: not ground.vehicle.armed, 15.0)
    assert waited_s == pytest.approx(10.0, abs=0.3)


def test_ardupilot_takeoff_verdicts() -> None:
    ground = station("ardupilot")
    ground.run(2.5)
    assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10) == FAILED  # disarmed, STABILIZE
    ground.command(MODE, 1, 4)
    assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10) == FAILED  # disarmed
    ground.command(ARM, 1)
    assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, -5) == FAILED
    assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10) == ACCEPTED
    ground.run_until(lambda: ground.vehicle.flying, 6.0)
    assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 20) == FAILED  # already flying
    ground.run(15.0)
    assert ground.vehicle.alt_home_m == pytest.approx(10.0, abs=0.3)


def test_px4_takeoff_height_is_above_mean_sea_level() -> None:
    ground = station("px4")
    ground.run(2.5)
    assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 186.0 + 12.0) == ACCEPTED  # a mode: before arming too
    assert ground.last("HEARTBEAT") is not None
    assert ground.command(ARM, 1) == ACCEPTED
    ground.run(15.0)
    assert ground.vehicle.alt_home_m == pytest.approx(12.0, abs=0.3)
    assert ground.last("HEARTBEAT").custom_mode == 4 << 16 | 3 << 24  # holds afterwards
    ground.command(LAND)
    ground.run_until(lambda: not ground.vehicle.armed, 60.0)


def test_px4_given_a_relative_height_climbs_the_minimum_only() -> None:
    """The classic mistake: 30 taken as AMSL lies under the ground, so it climbs MIS_TAKEOFF_ALT."""
    ground = station("px4")
    ground.run(2.5)
    ground.command(ARM, 1)
    assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 30.0) == ACCEPTED
    ground.run(15.0)
    assert ground.vehicle.alt_home_m == pytest.approx(2.5, abs=0.3)


@pytest.mark.parametrize(("flavour", "refusal"), [("ardupilot", FAILED), ("px4", REJECTED)])
def test_disarm_in_flight_needs_force(flavour: str, refusal: int) -> None:
    ground = station(flavour)
    fly(ground)
    assert ground.command(ARM, 0) == refusal
    assert ground.vehicle.armed
    assert ground.command(ARM, 0, FORCE) == ACCEPTED
    ground.run(4.0)
    assert ground.vehicle.body.on_ground  # dropped from the air


@pytest.mark.parametrize(("flavour", "verdict"), [("ardupilot", FAILED), ("px4", REJECTED)])
def test_unknown_mode_is_refused(flavour: str, verdict: int) -> None:
    ground = station(flavour)
    assert ground.command(MODE, 1, 99) == verdict


def test_mode_numbers_are_the_flavours_own() -> None:
    ardupilot, px4 = station("ardupilot"), station("px4")
    for ground, numbers, expected in ((ardupilot, (1, 4), 4), (px4, (1, 4, 5), 4 << 16 | 5 << 24)):
        ground.run(2.5)
        assert ground.command(MODE, *numbers) == ACCEPTED
        ground.run(1.1)
        assert ground.last("HEARTBEAT").custom_mode == expected
    assert ardupilot.last("HEARTBEAT").autopilot == mav.MAV_AUTOPILOT_ARDUPILOTMEGA
    assert px4.last("HEARTBEAT").autopilot == mav.MAV_AUTOPILOT_PX4


def test_old_set_mode_works_too() -> None:
    ground = station("ardupilot")
    ground.run(2.5)
    ground.send(mav.MAVLink_set_mode_message(1, 1, 4))
    ground.run(0.1)
    assert ground.vehicle.mode.name == "GUIDED"


def test_who_is_not_meant_is_silent() -> None:
    ground = station("ardupilot")
    ground.run(2.5)
    assert ground.command(ARM, 1, target=77) is None
    assert ground.command(31234) == UNSUPPORTED
    assert ground.command(31234, component=190) == UNSUPPORTED  # ArduPilot answers for other components
    assert ground.command(31234, target=0) == UNSUPPORTED
    other = station("px4")
    assert other.command(31234, component=190) is None
    assert other.command(31234) == UNSUPPORTED


def _rtl_leg(ground: Station) -> None:
    ground.run(1.2, every_s=0.1, do=lambda: ground.velocity(0, 0))
    ground.command(MODE, 1, *((4,) if ground.vehicle.flavour.name == "ardupilot" else (6,)))
    ground.run(8.0, every_s=0.1, do=lambda: ground.velocity(10, 5))


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_rtl_comes_home_and_disarms_2_s_after_touch_down(flavour: str) -> None:
    ground = station(flavour)
    fly(ground)
    _rtl_leg(ground)
    assert ground.command(RTL) == ACCEPTED
    ground.run_until(lambda: not ground.vehicle.flying, 200.0)
    assert ground.run_until(lambda: not ground.vehicle.armed, 5.0) == pytest.approx(2.0, abs=0.1)
    north, east, down = ground.vehicle.body.pos_ned_m
    assert (north, east, down) == pytest.approx((0.0, 0.0, 0.0), abs=0.6)


def test_ardupilot_lands_at_half_a_metre_a_second_below_10_m() -> None:
    ground = station("ardupilot")
    fly(ground)
    assert ground.command(LAND) == ACCEPTED
    ground.run_until(lambda: ground.vehicle.alt_home_m < 6.0, 60.0)
    assert ground.vehicle.body.vel_ned_mps[2] == pytest.approx(0.5, abs=0.05)
    assert ground.vehicle.landed_state == mav.MAV_LANDED_STATE_LANDING
