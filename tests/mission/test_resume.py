"""What becomes of each drone after a restart: the table, row by row."""

import pytest

from gcs.mission.drone import Control, Drone
from gcs.mission.resume import Resumption, Rise, Settle, takeover
from gcs.mission.steps import Down, FlyTo, Prime, Ready
from gcs.ports import (
    CampaignState,
    Checkpoint,
    DroneCheckpoint,
    FlightMode,
    SlotRecord,
    UavTrack,
    VehicleStatus,
)

NOW_S = 100.0
S, C, M = CampaignState, Control, FlightMode


def drone(
    mode: FlightMode, name: str = "", *, armed: bool = True, alt_m: float = 50.0, heard_s: float = NOW_S
) -> Drone:
    status = VehicleStatus(1, "px4", mode, name or mode.value, armed, heartbeat_s=heard_s)
    track = UavTrack(1, 10.0, 20.0, alt_m, 0.0, 0.0, 0.0, 0.0, 0.1)
    return Drone(0, 1, 50.0, (0.0, 0.0), status, track)


def judge(state: CampaignState, control: Control, found: Drone, *, active: bool = False) -> object:
    """Control after the takeover, the kind of its first step, whether it takes part, and whether it is landed."""
    fate = takeover(state, DroneCheckpoint(1, control, active=active), found, NOW_S, 60.0)
    return fate.control, type(fate.steps[0]) if fate.steps else None, fate.active, fate.landed


@pytest.mark.parametrize(
    ("state", "control", "active", "found", "expected"),
    [
        (S.FLYING, C.GUIDED, True, drone(M.GUIDED), (C.STREAM, Prime, True, False)),
        (S.FLYING, C.GUIDED, True, drone(M.PILOT, "POSCTL"), (C.STREAM, Prime, True, False)),
        (S.FLYING, C.GUIDED, True, drone(M.PILOT, "MANUAL"), (C.RELEASED, None, False, False)),
        (S.FLYING, C.GUIDED, True, drone(M.RETURN), (C.RELEASED, None, False, False)),
        (S.FLYING, C.GUIDED, True, drone(M.GUIDED, heard_s=90.0), (C.GUIDED, None, True, False)),
        (S.FLYING, C.GUIDED, False, drone(M.GUIDED, heard_s=90.0), (C.GUIDED, FlyTo, False, False)),
        (S.RECOVERING, C.GUIDED, True, drone(M.GUIDED, heard_s=90.0), (C.GUIDED, FlyTo, False, False)),
        (S.RECOVERING, C.AUTOPILOT, False, drone(M.LAND, heard_s=90.0), (C.GUIDED, FlyTo, False, False)),
        (S.LAUNCHING, C.GUIDED, False, drone(M.GUIDED, heard_s=90.0), (C.RELEASED, None, False, False)),
        (S.FLYING, C.GUIDED, True, drone(M.GUIDED, armed=False, alt_m=0.0), (C.RELEASED, None, False, False)),
        (S.FLYING, C.RELEASED, False, drone(M.GUIDED), (C.RELEASED, None, False, False)),
        (S.FLYING, C.GUIDED, False, drone(M.GUIDED), (C.STREAM, Prime, False, False)),
        (S.PAUSED, C.GUIDED, True, drone(M.HOLD), (C.STREAM, Prime, True, False)),
        (S.LAUNCHING, C.AUTOPILOT, False, drone(M.HOLD, armed=False, alt_m=0.0), (C.AUTOPILOT, Ready, False, False)),
        (S.LAUNCHING, C.AUTOPILOT, False, drone(M.TAKEOFF, alt_m=0.2), (C.AUTOPILOT, Settle, False, False)),
        (S.LAUNCHING, C.AUTOPILOT, False, drone(M.TAKEOFF, alt_m=20.0), (C.AUTOPILOT, Rise, False, False)),
        (S.LAUNCHING, C.GUIDED, False, drone(M.GUIDED), (C.AUTOPILOT, Prime, False, False)),
        (S.RECOVERING, C.GUIDED, False, drone(M.GUIDED), (C.STREAM, Prime, False, False)),
        (S.RECOVERING, C.AUTOPILOT, False, drone(M.LAND, alt_m=5.0), (C.AUTOPILOT, Down, False, False)),
        (S.RECOVERING, C.AUTOPILOT, False, drone(M.LAND, alt_m=0.0), (C.AUTOPILOT, Down, False, False)),
        (S.RECOVERING, C.AUTOPILOT, False, drone(M.LAND, armed=False, alt_m=0.0), (C.AUTOPILOT, None, False, True)),
    ],
)
def test_takeover(state: CampaignState, control: Control, active: bool, found: Drone, expected: object) -> None:
    assert judge(state, control, found, active=active) == expected


def test_a_drone_that_had_landed_needs_not_be_heard_again() -> None:
    was = DroneCheckpoint(1, C.AUTOPILOT, landed=True)
    fate = takeover(S.RECOVERING, was, drone(M.LAND, heard_s=90.0), NOW_S, 60.0)
    assert (fate.control, fate.landed, fate.silent) == (C.AUTOPILOT, True, False)


def checkpoint(state: CampaignState, slot: int, elapsed_s: float) -> Checkpoint:
    return Checkpoint("c", state, "landed", "", slot, elapsed_s, 18.0, 4.0, 0, (DroneCheckpoint(1, "guided"),))


def record(slot: int) -> SlotRecord:
    return SlotRecord(slot, 40.0 + 15.0 * slot, (), (), None)


@pytest.mark.parametrize(("slots", "start_s"), [(3, -8.0), (4, 7.0), (5, 22.0)])
def test_a_slot_that_is_recorded_after_the_checkpoint_moves_the_clock_on(slots: int, start_s: float) -> None:
    records = tuple(record(i) for i in range(slots + 1))
    resumption = Resumption(checkpoint(S.FLYING, 3, 2.0), records, taken_s=-6.0)
    assert resumption.slot_start_s == pytest.approx(start_s)


def test_a_campaign_without_books_is_brought_to_its_launch_points_again() -> None:
    assert Resumption(checkpoint(S.FLYING, 0, 0.0), (), 0.0).state is S.LAUNCHING
    assert Resumption(checkpoint(S.FLYING, 0, 0.0), (record(0),), 0.0).state is S.FLYING
