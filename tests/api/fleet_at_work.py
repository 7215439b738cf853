"""A large fleet over a large crowd: snapshots as a flight of a hundred makes them."""

import math

from gcs.ports import (
    CampaignSnapshot,
    CampaignState,
    FlightMode,
    FlightSnapshot,
    Landed,
    SlotRecord,
    UavPlan,
    UserSlot,
    VehicleStatus,
)
from policy.world.metrics import Metrics

RATE_HZ = 5.0
SLOT_S = 15.0


def fleet_snapshot(tick: int, *, vehicles: int = 100, users: int = 2000, campaign_id: str = "c1") -> FlightSnapshot:
    """Everybody circles; users change at the end of each slot only."""
    time_s = tick / RATE_HZ
    slot = int(time_s // SLOT_S)
    people = tuple(_user(i, slot) for i in range(users))
    plans = tuple(
        UavPlan(i + 1, 0.1 * i + slot, 17.3, tuple((13.7 * i + 11.1 * k, 7.9 * i + 3.3 * k) for k in range(6)))
        for i in range(vehicles)
    )
    metrics = Metrics(5.0 + math.sin(slot), 0.81 + 0.01 * math.sin(slot), 0.43, 0.1 + 0.001 * slot, 6.1)
    campaign = CampaignSnapshot(
        campaign_id,
        "large",
        "gcrl",
        CampaignState.FLYING,
        slot,
        120,
        SLOT_S,
        time_s % SLOT_S,
        metrics=metrics,
        plans=plans,
        latest=SlotRecord(slot, slot * SLOT_S, (), people, metrics),
        decision_ms=61.2345,
        explanation={"predicted_user_enu_m": [[user.east_m, user.north_m] for user in people]},
    )
    return FlightSnapshot(
        time_s, tick, tuple(_vehicle(i, time_s) for i in range(vehicles)), campaign, setpoint_period_s=0.1003
    )


def _vehicle(index: int, time_s: float) -> VehicleStatus:
    angle_rad = 0.07 * time_s + index
    return VehicleStatus(
        index + 1,
        autopilot="px4",
        mode=FlightMode.GUIDED,
        mode_name="OFFBOARD",
        armed=True,
        landed=Landed.IN_AIR,
        position_ready=True,
        lat_deg=47.4 + 0.003 * math.sin(angle_rad),
        lon_deg=8.55 + 0.004 * math.cos(angle_rad),
        alt_home_m=120.0 + 0.2 * math.sin(3.0 * angle_rad),
        vel_ned_mps=(17.0 * math.cos(angle_rad), -17.0 * math.sin(angle_rad), 0.03 * math.sin(9.0 * angle_rad)),
        yaw_rad=math.remainder(angle_rad, math.tau),
        battery_fraction=0.9 - 0.0003 * time_s,
        battery_v=22.0 - 0.001 * time_s,
        heartbeat_s=math.floor(time_s) - 0.1,
        position_s=time_s - 0.05 - 0.01 * (index % 5),
        loss_ratio=0.001 * (index % 7),
        address="127.0.0.1:14550",
    )


def _user(index: int, slot: int) -> UserSlot:
    east_m, north_m = (731.123456 * index + 17.7 * slot) % 1600.0, (397.654321 * index + 9.9 * slot) % 1200.0
    return UserSlot(f"u{index}", east_m, north_m, float(1 + (index + slot) % 9), 0.3 * ((index + slot) % 9), False)
