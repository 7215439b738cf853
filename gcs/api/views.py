"""Flight values in the stream's words (gcs.api.schemas). Pure."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict

from gcs.api.schemas import (
    CampaignView,
    EventMessage,
    MetricsView,
    PlanView,
    SnapshotMessage,
    UserView,
    VehicleView,
    VerdictView,
)
from gcs.mission.watch import return_energy_j
from gcs.ports import CampaignSnapshot, Event, FlightSnapshot, SlotRecord, UavPlan, UserSlot, VehicleStatus
from gcs.store.event_tail import NumberedEvent
from gcs.store.jsonable import jsonable
from policy.world.frames import LocalFrame
from policy.world.metrics import Metrics

AT_REST_MPS = 0.3  # below, the direction of travel is GNSS noise


def snapshot_message(
    snapshot: FlightSnapshot,
    *,
    healthy: bool,
    frame: LocalFrame | None,
    verdicts: Mapping[int, Event],
    battery_j: float | None = None,
    plans: list[PlanView] | None = None,
) -> SnapshotMessage:
    """Without users: the stream adds them for clients that have not had them. ``plans``: the campaign's, if made."""
    return SnapshotMessage(
        time_s=snapshot.time_s,
        tick=snapshot.tick,
        stopped=snapshot.stopped,
        stopped_ids=list(snapshot.stopped_ids),
        healthy=healthy,
        setpoint_period_s=snapshot.setpoint_period_s,
        vehicles=[
            vehicle_view(vehicle, snapshot.time_s, frame, verdicts.get(vehicle.system_id), battery_j)
            for vehicle in snapshot.vehicles
        ],
        campaign=None if snapshot.campaign is None else campaign_view(snapshot.campaign, plans),
    )


def vehicle_view(
    vehicle: VehicleStatus,
    now_s: float,
    frame: LocalFrame | None,
    verdict: Event | None,
    battery_j: float | None = None,
) -> VehicleView:
    """One vehicle at ``now_s`` on the flight clock; ``battery_j``: of a full battery, where a mission says it."""
    north_mps, east_mps, _ = vehicle.vel_ned_mps
    speed_mps = math.hypot(north_mps, east_mps)
    travel_rad = math.atan2(east_mps, north_mps) if speed_mps > AT_REST_MPS else vehicle.yaw_rad
    east_m, north_m = _place(vehicle, frame)
    return VehicleView(
        system_id=vehicle.system_id,
        autopilot=vehicle.autopilot,
        mode=vehicle.mode.value,
        mode_name=vehicle.mode_name,
        armed=vehicle.armed,
        landed=vehicle.landed.value,
        position_ready=vehicle.position_ready,
        lat_deg=vehicle.lat_deg,
        lon_deg=vehicle.lon_deg,
        east_m=east_m,
        north_m=north_m,
        alt_home_m=vehicle.alt_home_m,
        vel_ned_mps=vehicle.vel_ned_mps,
        yaw_rad=vehicle.yaw_rad,
        heading_deg=_degrees(travel_rad),
        speed_mps=speed_mps,
        battery_fraction=vehicle.battery_fraction,
        return_fraction=None if battery_j is None or frame is None else return_fraction(vehicle, frame, battery_j),
        battery_v=vehicle.battery_v,
        loss_ratio=vehicle.loss_ratio,
        heartbeat_age_s=_age_s(vehicle.heartbeat_s, now_s),
        position_age_s=_age_s(vehicle.position_s, now_s),
        address=vehicle.address,
        last_verdict=None if verdict is None else verdict_view(verdict),
        texts=[str(jsonable(text)) for text in vehicle.texts],
    )


def return_fraction(vehicle: VehicleStatus, frame: LocalFrame, battery_j: float) -> float | None:
    """Share of a full battery to fly straight home against the assumed wind and land, as the mission manager counts."""
    places = (vehicle.lat_deg, vehicle.lon_deg, vehicle.home_lat_deg, vehicle.home_lon_deg)
    if None in places or vehicle.alt_home_m is None:
        return None
    here_m = frame.to_enu_m(vehicle.lat_deg, vehicle.lon_deg)
    home_m = frame.to_enu_m(vehicle.home_lat_deg, vehicle.home_lon_deg)
    distance_m = math.dist([float(x) for x in here_m], [float(x) for x in home_m])
    return return_energy_j(distance_m, max(0.0, vehicle.alt_home_m)) / battery_j


def campaign_view(campaign: CampaignSnapshot, plans: list[PlanView] | None = None) -> CampaignView:
    """Without users; ``plans`` where they have been made before."""
    return CampaignView(
        campaign_id=campaign.campaign_id,
        name=campaign.name,
        policy=campaign.policy,
        state=campaign.state.value,
        slot=campaign.slot,
        slots=campaign.slots,
        slot_s=campaign.slot_s,
        slot_elapsed_s=campaign.slot_elapsed_s,
        reason=str(jsonable(campaign.reason)),
        metrics=metrics_view(campaign.metrics),
        plans=plan_views(campaign.plans) if plans is None else plans,
        users=None,
        users_slot=None if campaign.latest is None else campaign.latest.slot,
        decision_ms=campaign.decision_ms,
        explanation=jsonable(campaign.explanation),
    )


def plan_views(plans: Sequence[UavPlan]) -> list[PlanView]:
    """What the UAVs do in the present slot."""
    return [_plan_view(plan) for plan in plans]


def metrics_view(metrics: Metrics | None) -> MetricsView | None:
    """The four metrics and the final AoI."""
    return None if metrics is None else MetricsView(**asdict(metrics))


def user_views(record: SlotRecord) -> list[UserView]:
    """Everybody at the end of a slot; who left has no place."""
    return [_user_view(user) for user in record.users]


def event_message(numbered: NumberedEvent) -> EventMessage:
    """One event of the tail."""
    event = numbered.event
    return EventMessage(
        sequence=numbered.sequence,
        time_s=event.time_s,
        kind=event.kind,
        severity=event.severity.value,
        message=str(jsonable(event.message)),
        campaign_id=event.campaign_id,
        system_id=event.system_id,
        actor=str(jsonable(event.actor)),
        data=jsonable(event.data),
    )


def verdict_view(event: Event) -> VerdictView:
    """From a ``command.verdict`` event; its data names command, result and reason."""
    data = event.data
    return VerdictView(
        command=str(jsonable(data.get("command", ""))),
        result=str(jsonable(data.get("result", ""))),
        reason=str(jsonable(data.get("reason", event.message))),
        time_s=event.time_s,
    )


def _user_view(user: UserSlot) -> UserView:
    return UserView(
        user_id=user.user_id,
        east_m=_finite(user.east_m),
        north_m=_finite(user.north_m),
        aoi_slots=user.aoi_slots,
        data_mb=user.data_mb,
        served=user.served,
    )


def _plan_view(plan: UavPlan) -> PlanView:
    heading_deg = _degrees(plan.heading_rad)
    path_m = list(plan.path_enu_m)
    return PlanView(system_id=plan.system_id, heading_deg=heading_deg, speed_mps=plan.speed_mps, path_m=path_m)


def _place(vehicle: VehicleStatus, frame: LocalFrame | None) -> tuple[float | None, float | None]:
    if frame is None or vehicle.lat_deg is None or vehicle.lon_deg is None:
        return None, None
    east_m, north_m = frame.to_enu_m(vehicle.lat_deg, vehicle.lon_deg)
    return float(east_m), float(north_m)


def _degrees(angle_rad: float) -> float:
    """[0, 360), whatever the turn."""
    degrees = math.degrees(angle_rad) % 360.0
    return 0.0 if degrees >= 360.0 else degrees


def _age_s(then_s: float | None, now_s: float) -> float | None:
    return None if then_s is None else max(0.0, now_s - then_s)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
