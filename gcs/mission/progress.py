"""What each state of a campaign does at each tick, from the launch to the last landing."""

from gcs.mission.aftermath import COMING_DOWN_S, ending_of, is_coming_down, left_in_the_air
from gcs.mission.campaign import Campaign
from gcs.mission.campaign_log import CampaignLog
from gcs.mission.changes import Changes, bring_all_down
from gcs.mission.drone import Control, Drone
from gcs.mission.slot_flight import SlotFlight
from gcs.mission.states import Trigger
from gcs.mission.watch import battery_low
from gcs.ports import CampaignState, Severity


class Progress:
    """One a manager; ``virtual``: time stands still while a decision is awaited."""

    def __init__(self, changes: Changes, log: CampaignLog, *, virtual: bool) -> None:
        self._changes, self._log, self._virtual = changes, log, virtual

    def begin_policy(self, campaign: Campaign) -> None:
        """Which policy, from which weights, begun with what, stands in the log before it decides anything."""
        order = campaign.order
        order.planner.begin(campaign.scenario, campaign.policy_seed)
        data = {**order.provenance, "policy": order.policy, "session": campaign.session, "seed": campaign.policy_seed}
        self._log.event("policy.begun", f"policy {order.policy} begins", data=data)

    def advance(self, campaign: Campaign, now_s: float) -> None:
        """What the present state does at each tick."""
        match campaign.state:
            case CampaignState.LAUNCHING if all(drone.script.finished for drone in campaign.drones):
                self._begin_slots(campaign, now_s)
            case CampaignState.LAUNCHING | CampaignState.PAUSED:  # who waits in the air: nobody knows for how long
                self.check_batteries(campaign)
            case CampaignState.FLYING:
                self._fly(campaign, now_s)
            case CampaignState.RECOVERING if all(_is_settled(drone) for drone in campaign.drones):
                self._end(campaign, now_s)
            case _:
                pass

    def end_slots(self, campaign: Campaign) -> None:
        """The last slot is in the books: everyone comes home."""
        self._changes.move(campaign, Trigger.LAST_SLOT)
        bring_all_down(campaign)

    def check_batteries(self, campaign: Campaign) -> None:
        """Before each slot, and while it is waited for: who can fly it and still come home."""
        reserve = campaign.order.settings.battery_reserve
        for drone in campaign.drones:
            launched = campaign.state is CampaignState.LAUNCHING and drone.is_streamed and drone.script.finished
            if not (drone.active or launched) or drone.status is None or drone.track is None or drone.pad_m is None:
                continue
            dropout = battery_low(drone.status, drone.track, drone.pad_m, campaign.scenario, reserve)
            if dropout is not None:
                self._changes.drop(campaign, drone, dropout)

    def _begin_slots(self, campaign: Campaign, now_s: float) -> None:
        self._changes.move(campaign, Trigger.LAUNCHED)
        for drone in campaign.drones:
            drone.active = True
        campaign.slots = SlotFlight(campaign.order, campaign.scenario, campaign.drones, now_s, virtual=self._virtual)
        self._log.slot(campaign, campaign.slots.latest)
        self.check_batteries(campaign)

    def _fly(self, campaign: Campaign, now_s: float) -> None:
        slots = campaign.slots
        assert slots is not None
        record, trouble = slots.step(now_s)
        for decided in slots.take_decided():
            self._log.decision(campaign, campaign.signed(decided))
        if trouble is not None:
            self._log.event(trouble.kind, f"slot {slots.slot}: {trouble.reason}; the drones hold", Severity.CAUTION)
        if record is None:
            return
        self._log.slot(campaign, record)
        self._log.violations(campaign, record)
        if slots.finished:
            self.end_slots(campaign)
        else:
            self.check_batteries(campaign)

    def _end(self, campaign: Campaign, now_s: float) -> None:
        """Nothing is left to be done: everyone stands, or somebody was not seen to, and a person must know."""
        if campaign.settled_s is None:
            campaign.settled_s = now_s
        awaited = any(is_coming_down(drone, now_s) for drone in campaign.drones)
        if awaited and now_s - campaign.settled_s <= COMING_DOWN_S:
            return
        left = left_in_the_air(campaign.drones)
        self._log.setpoints(campaign, campaign.records[-1].slot + 1 if campaign.records else 0)
        trigger, reason = ending_of(campaign.ending, left), "; ".join((*filter(None, [campaign.reason]), *left))
        self._changes.move(campaign, trigger, reason)
        campaign.order.planner.close()


def _is_settled(drone: Drone) -> bool:
    """Down, or not ours any more."""
    return drone.landed or drone.control is Control.RELEASED
