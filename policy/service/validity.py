"""Does a state fit its campaign, and an answer the rules? Checked at the service's door, both ways."""

import numpy as np

from policy.agents.base import Decision
from policy.world.arrays import Array
from policy.world.scenario import Scenario
from policy.world.state import WorldState

SPEED_TOLERANCE_MPS = 1e-6
FAR_M = 1e6
"""Beyond this a position is a wrong frame or a wrong scale, not a place near the area."""


class StateError(ValueError):
    """A state that does not fit the campaign: one line."""


def check_state(scenario: Scenario, state: WorldState) -> None:
    """Raise :class:`StateError` unless shapes, numbers and slot make sense for ``scenario``."""
    num_uavs, num_users = scenario.num_uavs, scenario.num_users
    expected = {
        "uav_pos_enu_m": (num_uavs, 2),
        "uav_vel_enu_mps": (num_uavs, 2),
        "uav_energy_j": (num_uavs,),
        "uav_active": (num_uavs,),
        "user_pos_enu_m": (num_users, 2),
        "user_data_mb": (num_users,),
        "user_aoi_slots": (num_users,),
        "user_active": (num_users,),
    }
    for name, shape in expected.items():
        values = np.asarray(getattr(state, name))
        if values.shape != shape:
            raise StateError(f"state.{name}: has shape {list(values.shape)}, the campaign needs {list(shape)}")
        if not np.all(np.isfinite(values)):
            raise StateError(f"state.{name}: holds NaN or infinity; leave inactive ones finite too")
    for name in ("uav_pos_enu_m", "user_pos_enu_m"):
        if np.any(np.abs(getattr(state, name)) > FAR_M):
            raise StateError(f"state.{name}: is more than {FAR_M:g} m away; give metres from the south-west corner")
    for name in ("uav_energy_j", "user_data_mb", "user_aoi_slots"):
        if np.any(getattr(state, name) < 0.0):
            raise StateError(f"state.{name}: is negative")
    if not 0 <= state.slot < scenario.slots:
        raise StateError(f"state.slot: is {state.slot}, the campaign has slots 0 to {scenario.slots - 1}")


def fault_in(scenario: Scenario, decision: Decision) -> str | None:
    """What is wrong with a policy's answer, or None."""
    action = decision.action
    fault = _velocity_fault(scenario, action.heading_rad, action.speed_mps)
    if fault is not None or action.end_heading_rad is None:
        return fault
    fault = _velocity_fault(scenario, action.end_heading_rad, action.end_speed_mps)
    return None if fault is None else f"at the slot's end {fault}"


def _velocity_fault(scenario: Scenario, headings_rad: Array, speeds_mps: Array) -> str | None:
    heading, speed = np.asarray(headings_rad), np.asarray(speeds_mps)
    shape = (scenario.num_uavs,)
    if heading.shape != shape or speed.shape != shape:
        return f"headings {list(heading.shape)} and speeds {list(speed.shape)} instead of {list(shape)}"
    if not (np.all(np.isfinite(heading)) and np.all(np.isfinite(speed))):
        return "a heading or speed that is not finite"
    if np.any(speed < 0.0) or np.any(speed > scenario.max_speed_mps + SPEED_TOLERANCE_MPS):
        return f"a speed outside 0 to {scenario.max_speed_mps:g} m/s"
    return None
