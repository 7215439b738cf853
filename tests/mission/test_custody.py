"""Who flies a drone: the table, row by row, and the evidence that a change of mode was our own doing."""

from dataclasses import replace

import pytest

from gcs.mission.custody import (
    GAP_MARGIN_S,
    GAP_MEMORY_S,
    SILENT_GIVE_UP_S,
    is_unreachable,
    judge_custody,
    link_gap,
    note_link,
)
from gcs.mission.drone import Control, Drone
from gcs.mission.fates import take_back
from gcs.mission.watch import Fate
from gcs.ports import CampaignState, CommandKind, FlightMode, Silence, UavTrack, VehicleLimits, VehicleStatus

NOW_S = 100.0
NEVER_S = float("-inf")
C, M, S = Control, FlightMode, CampaignState


def drone(mode: FlightMode, name: str = "", control: Control = C.GUIDED, **changes: object) -> Drone:
    status = VehicleStatus(1, "px4", mode, name or mode.value, armed=True, heartbeat_s=NOW_S, position_s=NOW_S)
    track = UavTrack(1, 0.0, 0.0, 50.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    made = Drone(0, 1, 50.0, (0.0, 0.0), status, track, control=control)
    for key, value in changes.items():
        setattr(made, key, value)
    return made


def fate(found: Drone, state: CampaignState = S.FLYING, stalled_s: float = NEVER_S) -> Fate | None:
    judged = judge_custody(found, state, NOW_S, stalled_s)
    return None if judged is None else judged.fate


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (drone(M.GUIDED), None),
        (drone(M.PILOT, "ALTCTL"), Fate.RELEASE),
        (drone(M.PILOT, "POSCTL"), Fate.RELEASE),
        (drone(M.HOLD, "AUTO.LOITER"), Fate.RELEASE),
        (drone(M.UNKNOWN), Fate.RELEASE),
        (drone(M.RETURN), Fate.FOLLOW),
        (drone(M.LAND), Fate.FOLLOW),
        (drone(M.LAND, ordering=CommandKind.LAND), None),
        (drone(M.HOLD, halted=True), None),
        (drone(M.PILOT, "POSCTL", halted=True), Fate.RELEASE),
        (drone(M.PILOT, "POSCTL", halted=True, parked_in="POSCTL"), None),
        (drone(M.PILOT, "ALTCTL", halted=True, parked_in="POSCTL"), Fate.RELEASE),
        (drone(M.HOLD, control=C.STREAM), None),
        (drone(M.PILOT, "STABILIZE", control=C.STREAM), Fate.RELEASE),
        (drone(M.PILOT, "POSCTL", gap_s=NOW_S - 1.0), Fate.REGAIN),
        (drone(M.HOLD, "AUTO.LOITER", gap_s=NOW_S - 1.0), Fate.REGAIN),
        (drone(M.PILOT, "ALTCTL", gap_s=NOW_S - 1.0), Fate.RELEASE),
        (drone(M.PILOT, "POSCTL", gap_s=NOW_S - GAP_MEMORY_S - 0.1), Fate.RELEASE),
        (drone(M.GUIDED, silent_s=NOW_S - 3.0), Fate.REGAIN),
    ],
)
def test_a_drone_under_our_velocity(found: Drone, expected: Fate | None) -> None:
    assert fate(found) == expected


@pytest.mark.parametrize(
    ("found", "state", "expected"),
    [
        (drone(M.TAKEOFF, control=C.AUTOPILOT), S.LAUNCHING, None),
        (drone(M.HOLD, control=C.AUTOPILOT), S.LAUNCHING, None),
        (drone(M.PILOT, "POSCTL", control=C.AUTOPILOT), S.LAUNCHING, Fate.RELEASE),
        (drone(M.RETURN, control=C.AUTOPILOT), S.LAUNCHING, Fate.FOLLOW),
        (drone(M.RETURN, control=C.AUTOPILOT), S.RECOVERING, None),
        (drone(M.PILOT, "POSCTL", control=C.AUTOPILOT), S.RECOVERING, Fate.RELEASE),
        (drone(M.PILOT, "STABILIZE", control=C.AUTOPILOT, landed=True), S.RECOVERING, None),
    ],
)
def test_a_pilot_is_respected_while_it_climbs_and_lands(
    found: Drone, state: CampaignState, expected: Fate | None
) -> None:
    assert fate(found, state) == expected


def test_on_the_ground_its_mode_is_nobodys_business() -> None:
    standing = drone(M.PILOT, "STABILIZE", control=C.AUTOPILOT)
    assert standing.track is not None
    standing.track = replace(standing.track, alt_home_m=0.0)
    assert fate(standing, S.LAUNCHING) is None


def test_a_stall_of_this_machine_is_a_gap_too_but_what_the_pilot_says_wins() -> None:
    found = drone(M.PILOT, "POSCTL")
    assert fate(found, stalled_s=NOW_S - 1.0) is Fate.REGAIN
    assert found.status is not None
    found.status = replace(found.status, texts=("Pilot took over using sticks",))
    assert fate(found, stalled_s=NOW_S - 1.0) is Fate.RELEASE


def test_a_silent_drone_is_waited_for_a_minute() -> None:
    silent = drone(M.GUIDED)
    assert silent.status is not None
    silent.status = replace(silent.status, heartbeat_s=NOW_S - 5.1, position_s=NOW_S - 5.1)
    assert fate(silent) is Fate.SILENT
    silent.silent_s = NOW_S - SILENT_GIVE_UP_S
    assert fate(silent) is None
    silent.silent_s -= 0.1
    assert fate(silent) is Fate.RELEASE


def test_a_drone_that_disarmed_in_flight_is_not_ours() -> None:
    found = drone(M.GUIDED)
    assert found.status is not None
    found.status = replace(found.status, armed=False)
    assert fate(found) is Fate.RELEASE


@pytest.mark.parametrize(
    ("position_s", "answered_s", "timeout_s", "expected"),
    [
        (99.9, 99.9, 1.0, False),
        (98.9, 99.9, 1.0, True),  # nothing comes down
        (99.9, 98.9, 1.0, True),  # nothing goes up: it does not answer
        (99.9, None, 1.0, False),  # it never answers: nothing can be told
        (98.0, 98.0, 3.0, False),  # shorter than its time-out
        (97.2, 99.9, 3.0, True),
        (98.0, 98.0, None, False),  # unknown: the longer one counts, a change of mode is a pilot's
    ],
)
def test_gap(position_s: float, answered_s: float | None, timeout_s: float | None, expected: bool) -> None:
    status = VehicleStatus(
        1, heartbeat_s=97.0, position_s=position_s, answered_s=answered_s, limits=VehicleLimits(18.0, 4.5, timeout_s)
    )
    assert link_gap(status, NOW_S) is expected


def test_a_gap_accounts_for_one_change_of_mode_also_when_it_shows_after_the_drone_is_heard_again() -> None:
    """The first heartbeat after a cut may still tell the mode from before it."""
    found = drone(M.GUIDED, "OFFBOARD", silent_s=NOW_S - 1.0, gap_s=NOW_S - 0.5)
    assert fate(found) is Fate.REGAIN
    take_back(found, S.FLYING, stopped=False)
    found.silent_s, found.halted = None, False
    assert found.status is not None
    found.status = replace(found.status, mode=M.PILOT, mode_name="POSCTL")
    assert fate(found) is Fate.REGAIN
    take_back(found, S.FLYING, stopped=False)
    assert fate(found) is Fate.RELEASE


def switched(reached_s: float, *silences: Silence, ours_s: float = NOW_S - 1.0) -> Drone:
    """A drone that shows POSCTL; it answers, and its stream may end after 1 s."""
    found = drone(M.PILOT, "POSCTL", ours_s=ours_s)
    assert found.status is not None
    limits = VehicleLimits(18.0, 4.5, 1.0)
    found.status = replace(
        found.status, answered_s=NOW_S, latency_s=0.2, reached_s=reached_s, silences=silences, limits=limits
    )
    note_link(found, found.status, NOW_S)
    return found


def test_a_silence_by_the_vehicles_own_clock_makes_a_change_of_mode_ours() -> None:
    assert fate(switched(NOW_S - 0.2)) is Fate.RELEASE
    assert fate(switched(NOW_S - 0.2, Silence(0.7, NOW_S - 0.3))) is Fate.RELEASE
    assert fate(switched(NOW_S - 0.2, Silence(1.1, NOW_S - 0.3))) is Fate.REGAIN


def test_a_silence_that_ended_before_the_last_heartbeat_in_our_mode_is_no_excuse() -> None:
    """Heartbeats may come late, by no more than the margin."""
    before = Silence(1.1, NOW_S - 1.0 - GAP_MARGIN_S - 0.1)
    assert fate(switched(NOW_S - 0.2, before)) is Fate.RELEASE
    assert fate(switched(NOW_S - 0.2, before, ours_s=NOW_S - 2.0)) is Fate.REGAIN


def test_while_it_is_not_known_what_it_got_nothing_is_decided() -> None:
    """What it answered last was sent 1.6 s ago: the answers of a cut that has just ended are still under way."""
    found = switched(NOW_S - 1.6)
    assert is_unreachable(found, NOW_S)
    assert fate(found) is Fate.SILENT
    pilot = switched(NOW_S - 0.1, Silence(0.5, NOW_S - 0.1))  # they came: nothing was cut
    assert not is_unreachable(pilot, NOW_S)
    assert fate(pilot) is Fate.RELEASE
    cut = switched(NOW_S - 0.1, Silence(1.5, NOW_S - 0.1))
    assert fate(cut) is Fate.REGAIN


def test_a_silence_accounts_for_one_change_of_mode() -> None:
    found = switched(NOW_S - 0.2, Silence(1.1, NOW_S - 0.3))
    take_back(found, S.FLYING, stopped=False)
    found.parked_in, found.halted = "", False
    assert found.status is not None
    note_link(found, found.status, NOW_S)
    assert fate(found) is Fate.RELEASE
