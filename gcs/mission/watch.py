"""Drop-outs in flight: when a drone leaves the campaign for its own sake (battery, motor, position). Pure rules."""

import math
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

import numpy as np

from gcs.ports import UavTrack, VehicleStatus
from policy.world.energy import propulsion_power_w
from policy.world.scenario import Scenario

RETURN_SPEED_MPS = 10.0
DESCENT_MPS = 1.5
SLOWEST_WAY_HOME_MPS = 1.0  # against a wind that leaves no more


class Fate(StrEnum):
    """What becomes of a drone that drops out."""

    RELEASE = "release"  # not ours any more: nothing is sent to it
    FOLLOW = "follow"  # its own return or landing is under way: nothing is sent, it is watched until it stands
    GO_HOME = "go_home"  # it returns and lands under our control, the rest go on
    SILENT = "silent"  # nothing is heard of it for the moment
    REGAIN = "regain"  # it is taken over again


@dataclass(frozen=True)
class DropOut:
    """Why a drone leaves (or comes back), in the operator's words."""

    fate: Fate
    reason: str


ASSUMED_WIND_MPS = 5.0  # against the way home, where the vehicle does not say that it blows harder


def return_energy_j(
    distance_m: float, altitude_m: float, wind_mps: float = ASSUMED_WIND_MPS, top_mps: float = 18.0
) -> float:
    """What flying home against the wind and landing in it costs by the world's model, which counts airspeed.

    ``top_mps``: the airspeed that it can fly; a wind near it makes the way home slow.
    """
    ground_mps = max(SLOWEST_WAY_HOME_MPS, min(RETURN_SPEED_MPS, top_mps - wind_mps))
    way_w, descent_w = _powers_w(ground_mps, wind_mps)
    return way_w * distance_m / ground_mps + descent_w * altitude_m / DESCENT_MPS


@lru_cache(maxsize=256)
def _powers_w(ground_mps: float, wind_mps: float) -> tuple[float, float]:
    """Flying against the wind and descending in it; asked for each vehicle at each tick, and mostly the same."""
    powers_w = propulsion_power_w(np.array([ground_mps + wind_mps, 0.0, wind_mps]))
    return float(powers_w[0]), float(np.max(powers_w[1:]))


@lru_cache(maxsize=256)
def _worst_power_w(top_mps: float, wind_mps: float) -> float:
    """Of a slot flown hovering, at full speed, or against the wind; of all vehicles at once when a slot begins."""
    return float(np.max(propulsion_power_w(np.array([0.0, top_mps, top_mps + wind_mps]))))


def battery_low(
    status: VehicleStatus, track: UavTrack, pad_m: tuple[float, float], scenario: Scenario, reserve: float
) -> DropOut | None:
    """Before each slot: after it the drone must still get home and land with a reserve."""
    if status.battery_fraction is None:
        return None
    wind_mps, top_mps = max(ASSUMED_WIND_MPS, status.wind_mps or 0.0), scenario.max_speed_mps
    reach_m = top_mps * scenario.slot_s
    distance_m = math.hypot(track.east_m - pad_m[0], track.north_m - pad_m[1]) + reach_m
    slot_j = _worst_power_w(top_mps, wind_mps) * scenario.slot_s
    need_j = return_energy_j(distance_m, track.alt_home_m, wind_mps, top_mps) + slot_j
    need = need_j / scenario.battery_j + reserve
    if status.battery_fraction >= need:
        return None
    have = f"its battery ({status.battery_fraction:.0%}) just brings it home"
    return DropOut(Fate.GO_HOME, f"{have} ({need:.0%} needed against {wind_mps:.0f} m/s of wind)")


def motor_failed(status: VehicleStatus) -> DropOut | None:
    """By the vehicle's own health flags: it flies with less thrust than everything here counts on."""
    if status.motors_ok:
        return None
    return DropOut(Fate.GO_HOME, "a motor has failed; it flies home slowly")


def position_lost(status: VehicleStatus) -> str:
    """Why its place is no base for a velocity, though it is reported; empty where it is."""
    if not status.satellites_ok:
        return "its satellite receiver has failed"
    return "" if status.position_ready else "it does not trust its own position"
