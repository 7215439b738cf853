"""The fleet's pre-flight checklist: pure, all vehicles at once, each line green or with its reason.

A red line forbids the start (only an admin may override, and that is recorded); a caution tells what the operator
should know or set; the campaign can be flown.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from gcs.fleet.track import is_link_lost, make_track
from gcs.mission.watch import return_energy_j
from gcs.ports import UavTrack, VehicleStatus
from policy.world.energy import propulsion_power_w
from policy.world.scenario import Scenario

OWN_SYSTEM_ID = 245  # of this ground station (gcs.links): ArduPilot's failsafe must listen to it
LOSSY, TOO_LOSSY = 0.05, 0.25  # share of messages lost: told, refused
LONG_TIMEOUT_S = 1.5  # a longer time-out makes the gate keep more distance
FAR_LAUNCH_M = 1_000.0  # from the pad to the launch point, in a straight line
LAUNCH_CLIMB_MPS = 2.0


class Grade(StrEnum):
    """How a line stands."""

    OK = "ok"
    CAUTION = "caution"
    RED = "red"


@dataclass(frozen=True)
class Line:
    """One check of one vehicle."""

    system_id: int
    check: str
    grade: Grade
    reason: str = ""

    @property
    def ok(self) -> bool:
        """Forbids nothing."""
        return self.grade is not Grade.RED

    def words(self) -> str:
        """For messages."""
        return f"drone {self.system_id} {self.check}: {self.reason or self.grade}"


@dataclass(frozen=True)
class _Seat:
    """One vehicle and what the campaign wants of it."""

    status: VehicleStatus
    track: UavTrack | None
    scenario: Scenario
    launch_m: tuple[float, float]
    reserve: float
    now_s: float


def check_fleet(
    scenario: Scenario,
    system_ids: Sequence[int],
    vehicles: Mapping[int, VehicleStatus],
    now_s: float,
    reserve: float,
) -> tuple[Line, ...]:
    """All lines of all vehicles, in the order of the mission's UAVs; ``reserve`` is a share of the battery."""
    lines: list[Line] = []
    for index, system_id in enumerate(system_ids):
        status = vehicles.get(system_id)
        if status is None or is_link_lost(status, now_s):
            lines.append(Line(system_id, "link", Grade.RED, "has not been heard for 5 s; check its address and power"))
            continue
        launch_m = (float(scenario.launch_enu_m[index, 0]), float(scenario.launch_enu_m[index, 1]))
        track = make_track(status, scenario.area.frame, now_s)
        lines.extend(_lines(_Seat(status, track, scenario, launch_m, reserve, now_s)))
    return tuple(lines)


def red_lines(lines: Sequence[Line]) -> tuple[Line, ...]:
    """What forbids the start."""
    return tuple(line for line in lines if not line.ok)


def _lines(seat: _Seat) -> Iterator[Line]:
    for check, rule in _RULES:
        grade, reason = rule(seat)
        yield Line(seat.status.system_id, check, grade, reason)


_Finding = tuple[Grade, str]
_GOOD: _Finding = (Grade.OK, "")


def _link(seat: _Seat) -> _Finding:
    if seat.status.conflict:
        return Grade.RED, seat.status.conflict
    loss = seat.status.loss_ratio
    if loss > LOSSY:
        return (Grade.RED if loss > TOO_LOSSY else Grade.CAUTION), f"loses {loss:.0%} of its messages"
    return _GOOD


def _autopilot(seat: _Seat) -> _Finding:
    if seat.status.autopilot not in {"px4", "ardupilot"}:
        return Grade.RED, f"is neither PX4 nor ArduPilot ({seat.status.autopilot})"
    return _GOOD


def _position(seat: _Seat) -> _Finding:
    if not seat.status.position_ready or seat.track is None:
        said = f"; it says: {seat.status.texts[-1]}" if seat.status.texts else ""
        return Grade.RED, f"not ready by the vehicle's own flags{said}"
    return (Grade.RED, f"is {seat.track.age_s:.1f} s old") if seat.track.is_stale else _GOOD


def _home(seat: _Seat) -> _Finding:
    if seat.status.home_lat_deg is None:
        return Grade.RED, "not reported; without it heights above home mean nothing"
    return _GOOD


def _ground(seat: _Seat) -> _Finding:
    if seat.status.armed:
        return Grade.RED, "is armed already; land and disarm it first"
    return _GOOD


def _place(seat: _Seat) -> _Finding:
    if seat.track is None:
        return Grade.RED, "place unknown"
    east_m, north_m = seat.track.east_m, seat.track.north_m
    width_m, height_m = seat.scenario.area.size_m
    if not (0.0 <= east_m <= width_m and 0.0 <= north_m <= height_m):
        return Grade.RED, f"stands outside the area ({east_m:.0f} m east, {north_m:.0f} m north of its corner)"
    distance_m = _launch_distance_m(seat)
    if distance_m > FAR_LAUNCH_M:
        return Grade.RED, f"its launch point is {distance_m:.0f} m away; {FAR_LAUNCH_M:.0f} m are allowed"
    return _GOOD


def _battery(seat: _Seat) -> _Finding:
    have = seat.status.battery_fraction
    if have is None:
        return Grade.CAUTION, "the vehicle does not report its charge; nothing can watch over it"
    need = plan_energy_j(seat.scenario, _launch_distance_m(seat)) / seat.scenario.battery_j + seat.reserve
    if have < need:
        return Grade.RED, f"{have:.0%} charged, the plan and the way home need {need:.0%}"
    return _GOOD


def _limits(seat: _Seat) -> _Finding:
    limits, wanted_mps = seat.status.limits, seat.scenario.max_speed_mps
    words = []
    if limits.max_speed_mps is not None and limits.max_speed_mps < wanted_mps:
        words.append(f"flies {limits.max_speed_mps:g} m/s at most, the mission asks for {wanted_mps:g}: the plan obeys")
    if limits.max_accel_mps2 is None:
        words.append("its acceleration limit is not known; 4.5 m/s² is assumed")
    return (Grade.CAUTION, "; ".join(words)) if words else _GOOD


def _timeout(seat: _Seat) -> _Finding:
    timeout_s = seat.status.limits.setpoint_timeout_s
    if timeout_s is None:
        return Grade.CAUTION, "not known; 3 s are assumed, the gate keeps that much distance"
    if timeout_s > LONG_TIMEOUT_S:
        return (
            Grade.CAUTION,
            f"goes on for {timeout_s:g} s when setpoints stop; 1 s lets it fly nearer to fence and walls",
        )
    return _GOOD


def _failsafe(seat: _Seat) -> _Finding:
    values = seat.status.parameters
    if values.get("NAV_DLL_ACT") == 0.0:
        return Grade.CAUTION, "NAV_DLL_ACT is 0: it does nothing when ground control dies; 2 returns"
    if values.get("FS_GCS_ENABLE") == 0.0:
        return Grade.CAUTION, "FS_GCS_ENABLE is 0: it does nothing when ground control dies; 1 returns"
    listens_to = values.get("SYSID_MYGCS")
    if listens_to is not None and listens_to != OWN_SYSTEM_ID:
        return (
            Grade.CAUTION,
            f"its failsafe listens to ground station {listens_to:.0f}; set SYSID_MYGCS to {OWN_SYSTEM_ID}",
        )
    return _GOOD


_RULES = (
    ("link", _link),
    ("autopilot", _autopilot),
    ("position", _position),
    ("home", _home),
    ("ground", _ground),
    ("place", _place),
    ("battery", _battery),
    ("limits", _limits),
    ("setpoint time-out", _timeout),
    ("link failsafe", _failsafe),
)


def plan_energy_j(scenario: Scenario, launch_distance_m: float) -> float:
    """Climb, way out, all slots at the dearest speed, way home and landing, by the world's model."""
    power_w = propulsion_power_w(np.linspace(0.0, scenario.max_speed_mps, 19))
    dearest_w, hover_w = float(np.max(power_w)), float(power_w[0])
    climb_j = hover_w * scenario.altitude_m / LAUNCH_CLIMB_MPS
    way_j = return_energy_j(launch_distance_m, scenario.altitude_m) + return_energy_j(launch_distance_m, 0.0)
    return climb_j + way_j + dearest_w * scenario.slots * scenario.slot_s


def _launch_distance_m(seat: _Seat) -> float:
    if seat.track is None:
        return 0.0
    return math.hypot(seat.track.east_m - seat.launch_m[0], seat.track.north_m - seat.launch_m[1])
