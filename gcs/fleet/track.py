"""Where a vehicle is now, in the area's metres, from the newest that it said."""

import math

from gcs.ports import UavTrack, VehicleStatus
from policy.world.frames import LocalFrame

EXTRAPOLATE_S = 0.5  # a fix older than this is not carried forward further
SILENT_MODE_S = 12.0  # the mode is known from heartbeats only: without one nobody can say who flies
LINK_LOST_AFTER_S = 5.0  # five missed heartbeats (MAVLink heartbeat protocol)


def make_track(status: VehicleStatus, frame: LocalFrame, now_s: float) -> UavTrack | None:
    """The vehicle's place at ``now_s``, carried forward by its velocity; None before a usable position."""
    if status.lat_deg is None or status.lon_deg is None or status.alt_home_m is None or status.position_s is None:
        return None
    north_mps, east_mps, down_mps = status.vel_ned_mps
    age_s = max(0.0, now_s - status.position_s)
    ahead_s = min(age_s, EXTRAPOLATE_S)
    east_m, north_m = frame.to_enu_m(status.lat_deg, status.lon_deg)
    east_m, north_m = east_m + east_mps * ahead_s, north_m + north_mps * ahead_s
    alt_m = status.alt_home_m - down_mps * ahead_s
    if not math.isfinite(east_m + north_m + alt_m + status.yaw_rad):
        return None
    return UavTrack(status.system_id, east_m, north_m, alt_m, east_mps, north_mps, -down_mps, status.yaw_rad, age_s)


def is_link_lost(status: VehicleStatus, now_s: float) -> bool:
    """Nothing for :data:`LINK_LOST_AFTER_S`, or no heartbeat for :data:`SILENT_MODE_S`, or never one.

    With 30 % loss five heartbeats in a row get lost every few minutes; the positions between them show that it lives.
    """
    if status.heartbeat_s is None or now_s - status.heartbeat_s > SILENT_MODE_S:
        return True
    return now_s - max(status.heartbeat_s, status.position_s or 0.0) > LINK_LOST_AFTER_S
