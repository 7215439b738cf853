"""The same campaign with another fleet, radio or motion, checked like the file itself."""

from dataclasses import replace

import numpy as np

from policy.mission_file.checks import check_scenario, warnings_of
from policy.mission_file.mission import Mission
from policy.world.scenario import Scenario


def vary(
    mission: Mission,
    *,
    uavs: int | None = None,
    mcl_db: float | None = None,
    max_accel_mps2: float | None = None,
    slots: int | None = None,
) -> Mission:
    """``mission`` with what is not None replaced. Raises :class:`MissionError` when the result cannot be flown."""
    scenario = mission.scenario
    if uavs is not None:
        scenario = _with_uavs(mission, uavs)
    if mcl_db is not None:
        scenario = scenario.with_mcl(mcl_db)
    if max_accel_mps2 is not None:
        scenario = scenario.with_accel(max_accel_mps2)
    if slots is not None:
        scenario = replace(scenario, slots=slots)
    check_scenario(scenario, mission.source)
    return replace(mission, scenario=scenario, warnings=warnings_of(scenario))


def _with_uavs(mission: Mission, uavs: int) -> Scenario:
    """From the one launch point, or from the first launch points where each UAV has its own."""
    launch_m = mission.scenario.launch_enu_m
    if np.all(launch_m == launch_m[0]):
        return mission.scenario.with_uavs(uavs)
    if uavs > len(launch_m):
        mission.source.fail(
            ("fleet", "launch_m"),
            f"has {len(launch_m)} different points, too few for {uavs} UAVs; add points or give one for all",
        )
    return replace(mission.scenario, launch_enu_m=launch_m[:uavs])
