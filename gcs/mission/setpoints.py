"""One tick's velocities of a campaign: what each drone should be told, judged by the gate."""

from collections.abc import Callable
from dataclasses import replace

from gcs.guidance.tracking import approach
from gcs.mission.campaign import Campaign
from gcs.mission.drone import Drone
from gcs.ports import CampaignState, UavTrack
from gcs.safety.gate import SealedSetpoint, Wish


def fleet_setpoints(campaign: Campaign, now_s: float, stopped: Callable[[int], bool]) -> list[SealedSetpoint]:
    """What to send now; ``stopped``: the emergency stop holds this drone."""
    wishes = [
        _wish(campaign, drone, drone.track, now_s, stopped=stopped(drone.system_id))
        for drone in campaign.drones
        if drone.is_streamed and drone.track is not None
    ]
    # A drone that its autopilot takes up or down levels off where it was told to: its climb is no threat.
    others = [
        replace(drone.track, vel_up_mps=0.0)
        for drone in campaign.drones
        if drone.track is not None and not drone.is_streamed and drone.is_airborne
    ]
    others += [replace(track, vel_up_mps=0.0) for track in campaign.bystanders]
    return campaign.gate.judge(wishes, others)


def _wish(campaign: Campaign, drone: Drone, track: UavTrack, now_s: float, *, stopped: bool) -> Wish:
    gains, slots = campaign.order.settings.gains, campaign.slots
    in_slots = campaign.state in {CampaignState.FLYING, CampaignState.PAUSED} and drone.active
    if stopped or (drone.goal is None and not in_slots):
        here_m = (track.east_m, track.north_m)
        setpoint = approach(track, here_m, track.alt_home_m, campaign.scenario.max_speed_mps, gains)
    elif in_slots and slots is not None and not drone.halted:
        setpoint = slots.wish(drone, track, now_s)
    else:
        goal = drone.goal
        assert goal is not None
        setpoint = approach(track, goal.point_m, goal.alt_home_m, goal.speed_mps, gains)
    return Wish(setpoint, track)
