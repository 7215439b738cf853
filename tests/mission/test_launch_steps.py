"""How a drone's launch begins, by the mode that it stands on the ground in."""

import pytest

from gcs.mission.drone import Drone
from gcs.mission.order import FlightSettings
from gcs.mission.script import Crew, Done, Moment
from gcs.mission.steps import LAUNCH_STEPS, Order, Turn
from gcs.ports import CommandKind, FlightMode, UavTrack, VehicleStatus


def first_step(autopilot: str, mode: FlightMode) -> object:
    status = VehicleStatus(1, autopilot, mode, heartbeat_s=1.0, position_s=1.0)
    track = UavTrack(1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    drone = Drone(0, 1, 50.0, (0.0, 0.0), status, track, pad_m=(0.0, 0.0))
    crew = Crew((drone,), link=None, settings=FlightSettings(), size_m=(100.0, 100.0))  # type: ignore[arg-type]
    outcome = Turn().check(Moment(drone, crew, 1.0, 0.0))
    assert isinstance(outcome, Done)
    assert outcome.then[-len(LAUNCH_STEPS[autopilot]) :] == LAUNCH_STEPS[autopilot]
    return outcome.then[0]


@pytest.mark.parametrize("mode", [FlightMode.LAND, FlightMode.RETURN])
def test_px4_that_has_landed_leaves_its_landing_mode_before_it_arms(mode: FlightMode) -> None:
    assert first_step("px4", mode) == Order(CommandKind.HOLD)


@pytest.mark.parametrize(
    ("autopilot", "mode", "kind"),
    [
        ("px4", FlightMode.HOLD, CommandKind.ARM),
        ("px4", FlightMode.PILOT, CommandKind.ARM),
        ("ardupilot", FlightMode.LAND, CommandKind.GUIDED),
    ],
)
def test_others_begin_as_ever(autopilot: str, mode: FlightMode, kind: CommandKind) -> None:
    assert first_step(autopilot, mode) == Order(kind)
