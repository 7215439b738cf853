"""MAVSDK, which knows nothing of this project, flies the PX4 flavour over UDP."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import pytest
from mock_process import free_port, running

mavsdk = pytest.importorskip("mavsdk")
from mavsdk.plugins.action import Action  # noqa: E402
from mavsdk.plugins.offboard import Offboard, OffboardError, VelocityNedYaw  # noqa: E402
from mavsdk.plugins.telemetry import Telemetry  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Callable


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


def test_mavsdk_connects_arms_takes_off_and_streams_velocities() -> None:
    port = free_port()
    options = ("--first-port", str(port), "--flavour", "px4", "--ready-after-s", "3", "--speedup", "4")
    with running(*options, lockstep=False):
        configuration = mavsdk.Configuration.create_with_component_type(mavsdk.ComponentType.GROUND_STATION)
        client = mavsdk.Mavsdk(configuration)
        try:
            client.add_any_connection(f"udpout://127.0.0.1:{port}")
            system = client.first_autopilot(10.0)
            assert system is not None
            telemetry, action, offboard = Telemetry(system), Action(system), Offboard(system)
            wait(lambda: telemetry.health_all_ok() and telemetry.health().is_armable)
            assert telemetry.position().latitude_deg == pytest.approx(40.4258, abs=1e-6)
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
        finally:
            client.destroy()
