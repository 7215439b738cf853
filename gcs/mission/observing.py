"""What one tick sees of a campaign's drones: places, gaps in what they say, places that they do not trust."""

import math
from collections.abc import Mapping
from dataclasses import replace

from gcs.fleet.track import make_track
from gcs.mission.campaign import Campaign
from gcs.mission.campaign_log import CampaignLog
from gcs.mission.custody import note_link
from gcs.mission.drone import Drone
from gcs.mission.watch import position_lost
from gcs.ports import Severity, UavTrack, VehicleStatus

ON_GROUND_M = 1.0
FORGOTTEN_S = 60.0  # a drone of no campaign that is not heard for so long is not kept clear of any more


def observe(campaign: Campaign, vehicles: Mapping[int, VehicleStatus], now_s: float, log: CampaignLog) -> None:
    """Take in the newest of every drone, for the books and the monitor as well."""
    frame = campaign.scenario.area.frame
    for drone in campaign.drones:
        status = vehicles.get(drone.system_id)
        if status is None:
            drone.gap_s = now_s
            continue
        drone.status = status
        drone.track = make_track(status, frame, now_s) or drone.track
        note_link(drone, status, now_s)
        _doubt_position(drone, status, log)
    campaign.bystanders = _bystanders(campaign, vehicles, now_s)
    if campaign.slots is not None and not campaign.slots.finished:
        campaign.slots.measure(now_s)
    in_air = [d.track for d in campaign.drones if d.track is not None and (d.active or d.is_airborne)]
    campaign.monitor.tick(in_air)


def _bystanders(campaign: Campaign, vehicles: Mapping[int, VehicleStatus], now_s: float) -> list[UavTrack]:
    """Where own drones are that fly without the campaign: by an order of their own, or left by a campaign before."""
    ours, frame = set(campaign.order.system_ids), campaign.scenario.area.frame
    heard = [make_track(v, frame, now_s) for i, v in vehicles.items() if i not in ours and v.armed]
    return [t for t in heard if t is not None and t.alt_home_m > ON_GROUND_M and t.age_s <= FORGOTTEN_S]


def _doubt_position(drone: Drone, status: VehicleStatus, log: CampaignLog) -> None:
    """A place that the vehicle itself does not trust is as good as an old one: nobody steers by it."""
    why = position_lost(status) if drone.is_airborne else ""
    if why and drone.track is not None:
        drone.track = replace(drone.track, age_s=math.inf)
    if bool(why) != drone.doubted:
        drone.doubted = bool(why)
        words = f"{why}; it is told to hold and serves nobody" if why else "its position is good again"
        kind, severity = ("drone.position_lost", Severity.WARNING) if why else ("drone.position_back", Severity.INFO)
        log.event(kind, f"drone {drone.system_id}: {words}", severity, drone.system_id)
