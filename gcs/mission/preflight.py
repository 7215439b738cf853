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
from gcs.safety.envelope import FENCE_MARGIN_M, OBSTACLE_MARGIN_SHARE, VERTICAL_SEPARATION_M
from policy.world.energy import propulsion_power_w
from policy.world.geometry import distance_to_polygon_m
from policy.world.scenario import Scenario

OWN_SYSTEM_ID = 245  # of this ground station (gcs.links): ArduPilot's failsafe must listen to it
LOSSY, TOO_LOSSY = 0.05, 0.25  # share of messages lost: told, refused
LATE_S = 0.5  # there and back: the gate counts on as much from a decision to the vehicle's obeying
LONG_TIMEOUT_S = 1.5  # a longer time-out makes the gate keep more distance
FAR_LAUNCH_M = 1_000.0  # from the pad to the launch point, in a straight line
LAUNCH_CLIMB_MPS = 2.0
CLOCKS_APART_S = 2.0
OLDEST = {"px4": (1, 14), "ardupilot": (4, 3)}  # what the rules here were written against, and newer
# A stock ArduCopter was measured at 10.4 m/s with 30 degrees of lean and needs 51 for 18 m/s: between them a line.
MEASURED_LEAN_DEG, MEASURED_LEAN_MPS = (30.0, 51.0), (10.4, 18.0)


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
    clock_s: float | None  # the fleet's clock (median), as an offset to ours


def check_fleet(
    scenario: Scenario,
    system_ids: Sequence[int],
    vehicles: Mapping[int, VehicleStatus],
    now_s: float,
    reserve: float,
) -> tuple[Line, ...]:
    """All lines of all vehicles, in the order of the mission's UAVs; ``reserve`` is a share of the battery."""
    lines: list[Line] = []
    offsets_s = [v.clock_offset_s for i in system_ids if (v := vehicles.get(i)) and v.clock_offset_s is not None]
    clock_s = float(np.median(offsets_s)) if offsets_s else None
    for index, system_id in enumerate(system_ids):
        status = vehicles.get(system_id)
        if status is None or is_link_lost(status, now_s):
            lines.append(Line(system_id, "link", Grade.RED, "has not been heard for 5 s; check its address and power"))
            continue
        launch_m = (float(scenario.launch_enu_m[index, 0]), float(scenario.launch_enu_m[index, 1]))
        track = make_track(status, scenario.area.frame, now_s)
        lines.extend(_lines(_Seat(status, track, scenario, launch_m, reserve, now_s, clock_s)))
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
    if seat.status.latency_s is not None and seat.status.latency_s > LATE_S:
        return Grade.CAUTION, f"answers after {seat.status.latency_s:.1f} s"
    return _GOOD


def _autopilot(seat: _Seat) -> _Finding:
    if seat.status.autopilot not in {"px4", "ardupilot"}:
        return Grade.RED, f"is neither PX4 nor ArduPilot ({seat.status.autopilot})"
    return _GOOD


def _parameters(seat: _Seat) -> _Finding:
    """What the plan and the gate count with is read once, at the start: not before it is there."""
    if not seat.status.parameters_settled:
        return Grade.RED, "are still being read; wait some seconds (a minute on a bad link)"
    if seat.status.parameters_missing:
        return Grade.CAUTION, f"it does not tell {', '.join(seat.status.parameters_missing)}: look them up yourself"
    return _GOOD


def _motors(seat: _Seat) -> _Finding:
    if not seat.status.motors_ok:
        return Grade.RED, "it says that one has failed; mend it and reboot the autopilot"
    return _GOOD


def _position(seat: _Seat) -> _Finding:
    if not seat.status.position_ready or seat.track is None:
        said = f"; it says: {seat.status.texts[-1]}" if seat.status.texts else ""
        return Grade.RED, f"not ready by the vehicle's own flags{said}"
    if not seat.status.satellites_ok:
        return Grade.RED, "its satellite receiver has failed"
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
    edge_m = min(east_m, width_m - east_m, north_m, height_m - north_m)
    if edge_m < FENCE_MARGIN_M:
        words = f"stands {edge_m:.1f} m from the area's edge, and is kept {FENCE_MARGIN_M:g} m inside it"
        return Grade.RED, f"{words}: it could not come back to its pad; move it, or make the area larger"
    wall = _wall_over_pad(seat.scenario, (east_m, north_m))
    if wall:
        return Grade.RED, wall
    distance_m = _launch_distance_m(seat)
    if distance_m > FAR_LAUNCH_M:
        return Grade.RED, f"its launch point is {distance_m:.0f} m away; {FAR_LAUNCH_M:.0f} m are allowed"
    return _GOOD


def _wall_over_pad(scenario: Scenario, pad_m: tuple[float, float]) -> str:
    """Why a drone could not come back to a pad so near a wall, or climb from it; empty where it can."""
    point_m, margin_m = np.array(pad_m), OBSTACLE_MARGIN_SHARE * scenario.obstacle_margin_m
    for obstacle in scenario.area.obstacles:
        gap_m = float(distance_to_polygon_m(point_m, obstacle.polygon_m))
        if gap_m <= 0.0:
            return f'stands where obstacle "{obstacle.name}" is drawn; move it, or mend the map'
        if gap_m < margin_m and obstacle in scenario.blocking_obstacles:
            return (
                f'stands {gap_m:.1f} m from obstacle "{obstacle.name}", and is kept {margin_m:g} m off it in the air:'
                " it could not come back to its pad; move it"
            )
    return ""


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
        words.append(
            f"flies {limits.max_speed_mps:.3g} m/s at most, the mission asks for {wanted_mps:g}: the plan obeys"
        )
    if limits.max_speed_mps is None and seat.status.autopilot == "px4":
        words.append(f"its top speed is not known (MPC_XY_VEL_MAX); the plan counts on {wanted_mps:g} m/s")
    if limits.max_accel_mps2 is None:
        words.append("its acceleration limit is not known; 4.5 m/s² is assumed")
    return (Grade.CAUTION, "; ".join(words)) if words else _GOOD


def _lean(seat: _Seat) -> _Finding:
    """ArduPilot's top speed follows from lean and drag; where it does not tell its drag, a stock frame's counts."""
    have_cdeg, wanted_mps = seat.status.parameters.get("ANGLE_MAX"), seat.scenario.max_speed_mps
    if seat.status.autopilot != "ardupilot" or seat.status.limits.max_speed_mps is not None:
        return _GOOD
    if have_cdeg is None:
        return Grade.CAUTION, "it did not tell ANGLE_MAX: its top speed is not known, the plan cannot obey it"
    need_deg = float(np.interp(wanted_mps, MEASURED_LEAN_MPS, MEASURED_LEAN_DEG))
    if have_cdeg / 100.0 >= need_deg:
        return _GOOD
    words = f"leans {have_cdeg / 100.0:.0f}° at most (ANGLE_MAX); a stock frame needs {need_deg:.0f}°"
    return Grade.CAUTION, f"{words} for {wanted_mps:g} m/s: set EK3_DRAG_*, so that the plan knows, or max_speed_mps"


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


def _stream_end(seat: _Seat) -> _Finding:
    """Where PX4 goes when setpoints stop; 0 is a mode that needs a pilot's sticks."""
    if seat.status.parameters.get("COM_OBL_RC_ACT") == 0.0:
        return Grade.CAUTION, "COM_OBL_RC_ACT is 0: without setpoints it waits for a pilot's sticks; 5 holds"
    return _GOOD


def _battery_failsafe(seat: _Seat) -> _Finding:
    for name in ("COM_LOW_BAT_ACT", "BATT_FS_LOW_ACT"):
        if seat.status.parameters.get(name) == 0.0:
            return Grade.CAUTION, f"{name} is 0: it only warns when its battery runs low"
    return _GOOD


def _fence(seat: _Seat) -> _Finding:
    for name in ("GF_ACTION", "FENCE_ENABLE"):
        if seat.status.parameters.get(name) == 0.0:
            return Grade.CAUTION, f"{name} is 0: its own fence, the last line behind ours, is off"
    return _GOOD


def _layers(seat: _Seat) -> _Finding:
    """Only layers far enough apart keep drones apart whose ways cross; the gate counts on it."""
    layer_m = seat.scenario.layer_m
    if seat.scenario.num_uavs > 1 and layer_m < VERTICAL_SEPARATION_M:
        words = f"layers of {layer_m:g} m do not keep drones apart that fly over one another"
        return Grade.RED, f"{words}; set layer_m to 5 ({VERTICAL_SEPARATION_M:g} at least)"
    return _GOOD


def _return_height(seat: _Seat) -> _Finding:
    """A return that climbs goes through the layers of the drones above it."""
    values, scenario = seat.status.parameters, seat.scenario
    lowest_m = scenario.altitude_m - scenario.layer_m * (scenario.num_uavs - 1)
    height_m = values.get("RTL_RETURN_ALT", values.get("RTL_ALT", 0.0) / 100.0)
    if scenario.num_uavs > 1 and height_m > lowest_m:
        return (
            Grade.CAUTION,
            f"returns at {height_m:.0f} m, through the other drones' layers; set at most {lowest_m:.0f}",
        )
    return _GOOD


def _version(seat: _Seat) -> _Finding:
    status, oldest = seat.status, OLDEST.get(seat.status.autopilot)
    if not status.version:
        return Grade.CAUTION, "its firmware's version is not known"
    if oldest is not None and tuple(map(int, status.version.split(".")[:2])) < oldest:
        return Grade.CAUTION, f"firmware {status.version} is older than {oldest[0]}.{oldest[1]}"
    return _GOOD


def _clock(seat: _Seat) -> _Finding:
    mine_s = seat.status.clock_offset_s
    if mine_s is None or seat.clock_s is None:
        return Grade.CAUTION, "its clock is not known; its logs cannot be laid beside the others'"
    if abs(mine_s - seat.clock_s) > CLOCKS_APART_S:
        return Grade.CAUTION, f"its clock is {mine_s - seat.clock_s:+.1f} s off the fleet's"
    return _GOOD


_RULES = (
    ("link", _link),
    ("autopilot", _autopilot),
    ("version", _version),
    ("parameters", _parameters),
    ("position", _position),
    ("home", _home),
    ("motors", _motors),
    ("ground", _ground),
    ("place", _place),
    ("battery", _battery),
    ("limits", _limits),
    ("lean", _lean),
    ("setpoint time-out", _timeout),
    ("setpoints end", _stream_end),
    ("link failsafe", _failsafe),
    ("battery failsafe", _battery_failsafe),
    ("fence", _fence),
    ("layers", _layers),
    ("return height", _return_height),
    ("clock", _clock),
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
