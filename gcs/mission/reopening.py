"""Taking a campaign up again: the drones back into our hands, the books opened, the missed slots closed."""

from collections.abc import Callable
from dataclasses import dataclass

from gcs.mission.campaign import Campaign
from gcs.mission.campaign_log import CampaignLog
from gcs.mission.drone import Control, Drone
from gcs.mission.resume import LAUNCH_PATIENCE_S, PATIENCE_S, Resumption, has_reported, takeover
from gcs.mission.script import Script
from gcs.mission.slot_flight import FlownBefore, SlotFlight
from gcs.ports import CampaignState, DroneCheckpoint, Severity

Stopped = Callable[[int], bool]
"""The emergency stop holds this drone."""


@dataclass(frozen=True)
class Reopened:
    """How the campaign stands now; ``lost``: why each released drone is not ours any more."""

    flying: bool
    lost: tuple[str, ...]
    going_home: str


def is_due(campaign: Campaign, resumption: Resumption, waited_s: float, now_s: float) -> bool:
    """Everyone who was ours has been heard, or was waited for long enough."""
    patience_s = LAUNCH_PATIENCE_S if campaign.state is CampaignState.LAUNCHING else PATIENCE_S
    return has_reported(campaign.drones, resumption.checkpoint, now_s) or waited_s >= patience_s


def reopen(campaign: Campaign, log: CampaignLog, now_s: float, stopped: Stopped, *, virtual: bool) -> Reopened:
    """Everything that needs no decision of the manager: drones, slots, missed slots, and the event that tells it."""
    resumption = campaign.resumption
    assert resumption is not None
    was, campaign.resumption = resumption.checkpoint, None
    for drone, then in zip(campaign.drones, was.drones, strict=True):
        _take_over(campaign, drone, then, log, now_s, stopped)
    if resumption.records:
        paused = campaign.state is CampaignState.PAUSED
        start_s = now_s - was.slot_elapsed_s if paused else resumption.slot_start_s
        before = FlownBefore(resumption.records, start_s, paused)
        campaign.slots = SlotFlight(
            campaign.order, campaign.scenario, campaign.drones, now_s, virtual=virtual, before=before
        )
    flying = campaign.state is CampaignState.FLYING
    missed = campaign.slots.catch_up(now_s) if flying and campaign.slots is not None else ()
    slots = [record.slot for record in missed]
    data = {"state": str(campaign.state), "away_s": now_s - resumption.taken_s, "missed_slots": slots}
    words = f"taken up again while {campaign.state}; slots that ended unwatched: {len(missed)}"
    log.event("campaign.resumed", words, Severity.CAUTION, data=data)
    for record in missed:
        log.slot(campaign, record)
    lost = tuple(drone.reason for drone in campaign.drones if drone.control is Control.RELEASED)
    return Reopened(flying, lost, resumption.going_home)


def _take_over(
    campaign: Campaign, drone: Drone, then: DroneCheckpoint, log: CampaignLog, now_s: float, stopped: Stopped
) -> None:
    fate = takeover(campaign.state, then, drone, now_s, campaign.order.settings.ready_timeout_s)
    drone.pad_m = then.pad_m or _home_of(drone, campaign)
    drone.control, drone.active, drone.landed = fate.control, fate.active, fate.landed
    drone.halted, drone.script, drone.reason = fate.halted, Script(fate.steps), fate.reason
    drone.park()
    if fate.silent:
        drone.silent_s = drone.gap_s = now_s
        words = f"drone {drone.system_id}: it was not heard after the restart; it is waited for"
        log.event("drone.silent", words, Severity.WARNING, drone.system_id)
    if drone.is_streamed and stopped(drone.system_id):  # regained when a person takes the stop off
        drone.control, drone.halted, drone.script = Control.GUIDED, True, Script(())
    if fate.reason and then.control != Control.RELEASED:
        message = f"drone {drone.system_id}: {fate.reason}"
        log.event("drone.release", message, Severity.WARNING, drone.system_id)


def _home_of(drone: Drone, campaign: Campaign) -> tuple[float, float] | None:
    """The pad of a drone whose launch was under way: the vehicle's own home."""
    status = drone.status
    if status is None or status.home_lat_deg is None or status.home_lon_deg is None:
        return None
    east_m, north_m = campaign.scenario.area.frame.to_enu_m(status.home_lat_deg, status.home_lon_deg)
    return float(east_m), float(north_m)
