"""MAVSDK, which knows nothing of this project, flies both flavours over UDP."""

from __future__ import annotations

import time
from contextlib import contextmanager
from math import nan
from typing import TYPE_CHECKING, Any

import pytest
from mock_process import free_port, running

mavsdk = pytest.importorskip("mavsdk")
from mavsdk.plugins.action import Action  # noqa: E402
from mavsdk.plugins.geofence import Circle, FenceType, Geofence, GeofenceData, Point, Polygon  # noqa: E402
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan  # noqa: E402
from mavsdk.plugins.offboard import Offboard, OffboardError, VelocityNedYaw  # noqa: E402
from mavsdk.plugins.param import Param  # noqa: E402
from mavsdk.plugins.telemetry import FlightMode, Telemetry  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

LAT_DEG, LON_DEG = 40.4258, -86.9197


def wait(true: Callable[[], bool], limit_s: float = 15.0) -> None:
    """A foreign client runs on its own threads and the wall clock, so this looks until it is so."""
    end_s = time.monotonic() + limit_s
    while not true():
        assert time.monotonic() < end_s, "not reached in time"
        time.sleep(0.05)


def start(offboard: Any) -> bool:
    try:
        offboard.start()
    except OffboardError:
        return False  # PX4 wants setpoints for a second first
    return True


@contextmanager
def connected(flavour: str) -> Iterator[Any]:
    """A mock at four times real time, and MAVSDK's view of it."""
    port = free_port()
    options = ("--first-port", str(port), "--flavour", flavour, "--ready-after-s", "3", "--speedup", "4")
    with running(*options, lockstep=False):
        configuration = mavsdk.Configuration.create_with_component_type(mavsdk.ComponentType.GROUND_STATION)
        client = mavsdk.Mavsdk(configuration)
        try:
            client.add_any_connection(f"udpout://127.0.0.1:{port}")
            system = client.first_autopilot(10.0)
            assert system is not None
            yield system
        finally:
            client.destroy()


def item(north_m: float, east_m: float, up_m: float) -> MissionItem:
    """A waypoint so far from the pad."""
    return MissionItem(
        latitude_deg=LAT_DEG + north_m / 111_050.0,
        longitude_deg=LON_DEG + east_m / 84_900.0,
        relative_altitude_m=up_m,
        speed_m_s=12.0,
        is_fly_through=True,
        gimbal_pitch_deg=nan,
        gimbal_yaw_deg=nan,
        camera_action=MissionItem.CameraAction.NONE,
        loiter_time_s=nan,
        camera_photo_interval_s=1.0,
        acceptance_radius_m=3.0,
        yaw_deg=nan,
        camera_photo_distance_m=nan,
        vehicle_action=MissionItem.VehicleAction.NONE,
    )


def test_px4_takes_off_and_streams_velocities() -> None:
    with connected("px4") as system:
        telemetry, action, offboard = Telemetry(system), Action(system), Offboard(system)
        wait(lambda: telemetry.health_all_ok() and telemetry.health().is_armable)
        assert telemetry.position().latitude_deg == pytest.approx(LAT_DEG, abs=1e-6)
        action.set_takeoff_altitude(12.0)
        action.arm()
        action.takeoff()
        wait(lambda: telemetry.position().relative_altitude_m > 11.5)
        offboard.set_velocity_ned(VelocityNedYaw(5.0, -3.0, 0.0, 0.0))
        wait(lambda: start(offboard))
        wait(lambda: abs(telemetry.velocity_ned().north_m_s - 5.0) < 0.2)
        assert telemetry.velocity_ned().east_m_s == pytest.approx(-3.0, abs=0.3)
        offboard.stop()
        action.land()
        wait(lambda: not telemetry.armed(), 30.0)


def test_px4_parameters_fence_mission_and_return() -> None:
    with connected("px4") as system:
        telemetry, action, params = Telemetry(system), Action(system), Param(system)
        everything = params.get_all_params()
        assert len(everything.int_params) + len(everything.float_params) > 40
        assert params.get_param_int("COM_DL_LOSS_T") == 10
        params.set_param_float("RTL_RETURN_ALT", 25.0)
        assert params.get_param_float("RTL_RETURN_ALT") == 25.0
        corners = ((-0.01, -0.01), (-0.01, 0.01), (0.01, 0.01), (0.01, -0.01))
        square = [Point(LAT_DEG + north, LON_DEG + east) for north, east in corners]
        circle = Circle(Point(LAT_DEG + 0.005, LON_DEG), 30.0, FenceType.EXCLUSION)
        Geofence(system).upload_geofence(GeofenceData([Polygon(square, FenceType.INCLUSION)], [circle]))
        mission = Mission(system)
        mission.upload_mission(MissionPlan([item(0, 0, 15), item(60, 0, 15), item(60, 40, 20)]))
        back = mission.download_mission()
        assert [round(each.relative_altitude_m) for each in back.mission_items] == [15, 15, 20]
        wait(lambda: telemetry.health_all_ok() and telemetry.health().is_armable)
        action.arm()
        mission.start_mission()
        wait(lambda: telemetry.position().relative_altitude_m > 14.0)
        wait(mission.is_mission_finished, 30.0)
        assert telemetry.position().latitude_deg == pytest.approx(LAT_DEG + 60 / 111_050, abs=5e-5)
        action.return_to_launch()
        wait(lambda: telemetry.flight_mode() == FlightMode.RETURN_TO_LAUNCH)
        wait(lambda: not telemetry.armed(), 40.0)
        assert telemetry.position().latitude_deg == pytest.approx(LAT_DEG, abs=2e-5)


def test_ardupilot_as_far_as_mavsdk_supports_it() -> None:
    """Its health stays false, as on a real ArduCopter (measured): it never asks for what would tell it."""
    with connected("ardupilot") as system:
        telemetry, action = Telemetry(system), Action(system)
        telemetry.set_rate_position(10.0)
        wait(lambda: telemetry.position().relative_altitude_m == pytest.approx(0.0, abs=0.1))
        time.sleep(1.5)  # wall time: what MAVSDK has not heard by now it will not hear
        assert not telemetry.health().is_global_position_ok
        assert not telemetry.health_all_ok()
        assert Param(system).get_param_float("GUID_TIMEOUT") == 3.0
        action.set_takeoff_altitude(12.0)
        action.arm()
        action.takeoff()
        wait(lambda: telemetry.position().relative_altitude_m > 11.5)
        action.return_to_launch()
        wait(lambda: telemetry.flight_mode() == FlightMode.RETURN_TO_LAUNCH)
        wait(lambda: not telemetry.armed(), 40.0)
