"""Drop-outs in flight: pure rules that say when a drone leaves the campaign, and what becomes of it."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from gcs.fleet.track import is_link_lost
from gcs.ports import FlightMode, UavTrack, VehicleStatus
from policy.world.energy import propulsion_power_w
from policy.world.scenario import Scenario

RETURN_SPEED_MPS = 10.0
DESCENT_MPS = 1.5


class Fate(StrEnum):
    """What becomes of a drone that drops out."""

    RELEASE = "release"  # not ours any more: nothing is sent to it
    GO_HOME = "go_home"  # it returns and lands under our control, the rest go on


@dataclass(frozen=True)
class DropOut:
    """Why a drone leaves, in the operator's words."""

    fate: Fate
    reason: str


def control_lost(status: VehicleStatus | None, now_s: float) -> DropOut | None:
    """Link loss, a pilot's mode change, or motors off: the drone is not ours and is not fought over."""
    if status is None or is_link_lost(status, now_s):
        return DropOut(Fate.RELEASE, "its link is lost; its own failsafe flies it")
    if not status.armed:
        return DropOut(Fate.RELEASE, f"it disarmed in mode {status.mode_name}")
    if status.mode is not FlightMode.GUIDED:
        return DropOut(Fate.RELEASE, f"a pilot or its failsafe changed the mode to {status.mode_name or status.mode}")
    return None


ASSUMED_WIND_MPS = 5.0  # against the way home; no vehicle says reliably what blows, so it is assumed


def return_energy_j(distance_m: float, altitude_m: float, wind_mps: float = ASSUMED_WIND_MPS) -> float:
    """What flying home against the wind and landing in it costs by the world's model, which counts airspeed."""
    airspeeds_mps = np.array([RETURN_SPEED_MPS + wind_mps, 0.0, wind_mps])
    powers_w = propulsion_power_w(airspeeds_mps)
    descent_w = float(np.max(powers_w[1:]))
    return float(powers_w[0]) * distance_m / RETURN_SPEED_MPS + descent_w * altitude_m / DESCENT_MPS


def battery_low(
    status: VehicleStatus, track: UavTrack, pad_m: tuple[float, float], scenario: Scenario, reserve: float
) -> DropOut | None:
    """Before each slot: after it the drone must still get home and land with a reserve."""
    if status.battery_fraction is None:
        return None
    reach_m = scenario.max_speed_mps * scenario.slot_s
    distance_m = float(np.hypot(track.east_m - pad_m[0], track.north_m - pad_m[1])) + reach_m
    airspeeds_mps = np.array([0.0, scenario.max_speed_mps, scenario.max_speed_mps + ASSUMED_WIND_MPS])
    slot_j = float(np.max(propulsion_power_w(airspeeds_mps))) * scenario.slot_s
    need_j = return_energy_j(distance_m, track.alt_home_m) + slot_j
    need = need_j / scenario.battery_j + reserve
    if status.battery_fraction >= need:
        return None
    return DropOut(Fate.GO_HOME, f"its battery ({status.battery_fraction:.0%}) just brings it home ({need:.0%} needed)")
