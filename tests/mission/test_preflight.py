"""Each line of the checklist: green for a good vehicle, and its reason for each fault."""

from dataclasses import replace

import numpy as np
import pytest

from gcs.mission.preflight import Grade, Line, check_fleet, plan_energy_j, red_lines
from gcs.ports import VehicleLimits, VehicleStatus
from policy.mission_file import load_mission
from policy.world.scenario import Obstacle

SCENARIO = load_mission("demo").scenario
LAUNCH = SCENARIO.launch_enu_m[0]


def standing_at(east_m: float, north_m: float, **changes: object) -> VehicleStatus:
    lat_deg, lon_deg = SCENARIO.area.frame.to_geodetic_deg(east_m, north_m)
    good = VehicleStatus(
        1,
        autopilot="px4",
        position_ready=True,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        alt_home_m=0.0,
        home_lat_deg=lat_deg,
        home_lon_deg=lon_deg,
        battery_fraction=1.0,
        heartbeat_s=9.5,
        position_s=9.9,
        limits=VehicleLimits(18.0, 4.5, 1.0),
        parameters={"NAV_DLL_ACT": 2.0, "RTL_RETURN_ALT": 60.0, "COM_OBL_RC_ACT": 5.0},
        parameters_settled=True,
        version="1.15.4",
        clock_offset_s=3.0,
    )
    return replace(good, **changes)  # type: ignore[arg-type]


def copter(max_speed_mps: float | None, **parameters: float) -> dict[str, object]:
    """An ArduPilot vehicle that told these parameters and has this top speed by them."""
    limits = VehicleLimits(max_speed_mps, 2.5, 1.0)
    return {"autopilot": "ardupilot", "version": "4.5.6", "limits": limits, "parameters": parameters}


def lines_of(status: VehicleStatus) -> tuple[Line, ...]:
    return check_fleet(SCENARIO, [1], {1: status}, 10.0, 0.03)


def test_a_good_vehicle_is_green_in_every_line() -> None:
    lines = lines_of(standing_at(*LAUNCH))
    assert len(lines) == 20
    assert {line.grade for line in lines} == {Grade.OK}


@pytest.mark.parametrize(
    ("changes", "check", "grade", "words"),
    [
        ({"heartbeat_s": 1.0, "position_s": 1.0}, "link", Grade.RED, "5 s"),
        ({"conflict": "a second vehicle has the same system id"}, "link", Grade.RED, "second vehicle"),
        ({"loss_ratio": 0.1}, "link", Grade.CAUTION, "10%"),
        ({"loss_ratio": 0.4}, "link", Grade.RED, "40%"),
        ({"latency_s": 0.8}, "link", Grade.CAUTION, "after 0.8 s"),
        ({"autopilot": "unknown"}, "autopilot", Grade.RED, "neither"),
        ({"position_ready": False, "texts": ("PreArm: Compass",)}, "position", Grade.RED, "PreArm: Compass"),
        ({"position_s": 2.0}, "position", Grade.RED, "8.0 s old"),
        ({"satellites_ok": False}, "position", Grade.RED, "satellite receiver"),
        ({"motors_ok": False}, "motors", Grade.RED, "has failed"),
        ({"parameters_settled": False}, "parameters", Grade.RED, "still being read"),
        ({"parameters_missing": ("NAV_DLL_ACT", "GF_ACTION")}, "parameters", Grade.CAUTION, "NAV_DLL_ACT, GF_ACTION"),
        ({"limits": VehicleLimits(None, 4.5, 1.0)}, "limits", Grade.CAUTION, "MPC_XY_VEL_MAX"),
        ({"home_lat_deg": None}, "home", Grade.RED, "not reported"),
        ({"armed": True}, "ground", Grade.RED, "armed"),
        ({"battery_fraction": 0.05}, "battery", Grade.RED, "5% charged"),
        ({"battery_fraction": None}, "battery", Grade.CAUTION, "does not report"),
        ({"limits": VehicleLimits(12.0, 4.5, 1.0)}, "limits", Grade.CAUTION, "12 m/s"),
        ({"limits": VehicleLimits(18.0, None, 1.0)}, "limits", Grade.CAUTION, "not known"),
        ({"limits": VehicleLimits(18.0, 4.5, 3.0)}, "setpoint time-out", Grade.CAUTION, "3 s"),
        ({"limits": VehicleLimits(18.0, 4.5)}, "setpoint time-out", Grade.CAUTION, "not known"),
        ({"parameters": {"NAV_DLL_ACT": 0.0}}, "link failsafe", Grade.CAUTION, "NAV_DLL_ACT"),
        ({"parameters": {"FS_GCS_ENABLE": 0.0}}, "link failsafe", Grade.CAUTION, "FS_GCS_ENABLE"),
        ({"parameters": {"COM_OBL_RC_ACT": 0.0}}, "setpoints end", Grade.CAUTION, "5 holds"),
        ({"parameters": {"COM_LOW_BAT_ACT": 0.0}}, "battery failsafe", Grade.CAUTION, "only warns"),
        ({"parameters": {"BATT_FS_LOW_ACT": 0.0}}, "battery failsafe", Grade.CAUTION, "BATT_FS_LOW_ACT"),
        ({"parameters": {"GF_ACTION": 0.0}}, "fence", Grade.CAUTION, "last line"),
        ({"parameters": {"FENCE_ENABLE": 0.0}}, "fence", Grade.CAUTION, "FENCE_ENABLE"),
        ({"parameters": {"RTL_RETURN_ALT": 130.0}}, "return height", Grade.CAUTION, "at most 115"),
        ({"parameters": {"RTL_ALT": 13000.0}}, "return height", Grade.CAUTION, "130 m"),
        (copter(None, ANGLE_MAX=3000.0), "lean", Grade.CAUTION, "51°"),
        (copter(None, ANGLE_MAX=3000.0), "lean", Grade.CAUTION, "EK3_DRAG"),
        (copter(None), "lean", Grade.CAUTION, "not known"),
        (copter(14.876, ANGLE_MAX=3000.0), "limits", Grade.CAUTION, "flies 14.9 m/s at most"),
        ({"version": ""}, "version", Grade.CAUTION, "not known"),
        ({"version": "1.13.3"}, "version", Grade.CAUTION, "older than 1.14"),
        ({"clock_offset_s": None}, "clock", Grade.CAUTION, "not known"),
        ({"parameters": {"FS_GCS_ENABLE": 1.0, "SYSID_MYGCS": 255.0}}, "link failsafe", Grade.CAUTION, "245"),
    ],
)
def test_each_fault_has_its_line(changes: dict[str, object], check: str, grade: Grade, words: str) -> None:
    (bad,) = [line for line in lines_of(standing_at(*LAUNCH, **changes)) if line.grade is not Grade.OK]
    assert (bad.check, bad.grade) == (check, grade)
    assert words in bad.words()


@pytest.mark.parametrize("fits", [copter(None, ANGLE_MAX=5100.0), copter(18.0, ANGLE_MAX=3000.0)])
def test_a_copter_that_can_fly_the_plan_is_green(fits: dict[str, object]) -> None:
    assert all(line.grade is Grade.OK for line in lines_of(standing_at(*LAUNCH, **fits)))


@pytest.mark.parametrize(("east_m", "words"), [(-50.0, "outside the area"), (float(LAUNCH[0]), "")])
def test_the_pad_lies_inside_the_area(east_m: float, words: str) -> None:
    reds = red_lines(lines_of(standing_at(east_m, float(LAUNCH[1]))))
    assert [words in line.reason for line in reds] == ([True] if words else [])


@pytest.mark.parametrize(("uavs", "layer_m", "ok"), [(2, 3.9, False), (2, 0.0, False), (2, 4.0, True), (1, 0.0, True)])
def test_layers_too_near_to_each_other_are_refused(uavs: int, layer_m: float, *, ok: bool) -> None:
    scenario = replace(SCENARIO, layer_m=layer_m, launch_enu_m=np.tile(LAUNCH, (uavs, 1)))
    vehicles = {i + 1: replace(standing_at(*LAUNCH), system_id=i + 1) for i in range(uavs)}
    reds = red_lines(check_fleet(scenario, list(vehicles), vehicles, 10.0, 0.03))
    assert [line.check for line in reds] == [] if ok else ["layers"] * uavs


@pytest.mark.parametrize("edge", ["west", "east", "south", "north"])
def test_a_pad_that_the_gate_would_not_let_it_back_to_is_refused(edge: str) -> None:
    """It would hover beside its pad for a quarter of an hour, and then return by itself."""
    (width_m, height_m), (east_m, north_m) = SCENARIO.area.size_m, LAUNCH
    spots = {"west": (2.0, north_m), "east": (width_m - 2.0, north_m), "south": (east_m, 2.0)}
    (red,) = red_lines(lines_of(standing_at(*spots.get(edge, (east_m, height_m - 2.0)))))
    assert (red.check, "2.0 m from the area's edge" in red.reason) == ("place", True)


@pytest.mark.parametrize(
    ("height_m", "gap_m", "words"),
    [(200.0, 5.0, "kept 7.5 m off"), (200.0, 9.0, ""), (30.0, 5.0, ""), (30.0, -5.0, "mend the map")],
)
def test_a_pad_beside_a_wall_or_within_one_is_refused(height_m: float, gap_m: float, words: str) -> None:
    east_m, north_m = float(LAUNCH[0]), float(LAUNCH[1])
    west_m, south_m = east_m + gap_m, north_m - 20.0
    wall = ((west_m, south_m), (west_m + 40.0, south_m), (west_m + 40.0, south_m + 40.0), (west_m, south_m + 40.0))
    area = replace(SCENARIO.area, obstacles=(Obstacle("tower", height_m, wall),))
    lines = check_fleet(replace(SCENARIO, area=area), [1], {1: standing_at(*LAUNCH)}, 10.0, 0.03)
    reds = [line.reason for line in red_lines(lines)]
    assert [words in reason and '"tower"' in reason for reason in reds] == ([True] if words else [])


def test_a_vehicle_never_heard_is_one_red_line() -> None:
    (line,) = check_fleet(SCENARIO, [1], {}, 10.0, 0.03)
    assert (line.check, line.ok) == ("link", False)


def test_the_plan_costs_at_least_its_slots_in_the_cheapest_flight() -> None:
    cheapest_j = 120.0 * SCENARIO.slots * SCENARIO.slot_s
    assert plan_energy_j(SCENARIO, 500.0) > plan_energy_j(SCENARIO, 0.0) > cheapest_j
    assert np.isfinite(plan_energy_j(SCENARIO, 0.0))


def test_a_clock_that_differs_from_the_fleets_is_told() -> None:
    vehicles = {i: replace(standing_at(*LAUNCH), system_id=i, clock_offset_s=3.0 + 5.0 * (i == 2)) for i in (1, 2, 3)}
    three = replace(SCENARIO, launch_enu_m=np.tile(LAUNCH, (3, 1)))
    lines = check_fleet(three, [1, 2, 3], vehicles, 10.0, 0.03)
    off = [line for line in lines if line.check == "clock" and line.grade is not Grade.OK]
    assert [(line.system_id, line.reason) for line in off] == [(2, "its clock is +5.0 s off the fleet's")]
