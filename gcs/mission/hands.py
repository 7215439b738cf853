"""Each drone at each tick: who flies it, and the next thing that its script does with it."""

from gcs.mission.campaign import Campaign
from gcs.mission.campaign_log import CampaignLog
from gcs.mission.changes import Changes, anyone_left
from gcs.mission.custody import is_unreachable, judge_custody
from gcs.mission.drone import Control, Drone
from gcs.mission.emergency import EmergencyStop
from gcs.mission.fates import order_return, slow_down, take_back
from gcs.mission.script import Crew
from gcs.mission.watch import DropOut, Fate, battery_low, motor_failed
from gcs.ports import CampaignState, Severity, VehicleStatus


class Hands:
    """Over the drones that are ours; one a manager."""

    def __init__(self, changes: Changes, log: CampaignLog, emergency: EmergencyStop) -> None:
        self._changes, self._log, self._emergency = changes, log, emergency

    def watch(self, campaign: Campaign, now_s: float, stalled_s: float) -> None:
        """Who flies each drone that is ours; ``stalled_s``: when this process last stood still."""
        for drone in campaign.drones:
            if drone.control is Control.RELEASED or drone.landed:
                continue
            self._battery(campaign, drone)
            found = judge_custody(drone, campaign.state, now_s, stalled_s)
            if found is None and drone.status is not None and drone.is_airborne:
                found = self._motor(campaign, drone, drone.status)
            heard = drone.silent_s is not None and not is_unreachable(drone, now_s)
            if found is None and not heard:
                continue
            if heard:
                drone.silent_s = None
            if found is None:
                self._log.event("drone.heard", f"drone {drone.system_id} is heard again", system_id=drone.system_id)
            elif found.fate is Fate.SILENT:
                drone.silent_s = now_s
                self._changes.tell(drone, found, Severity.WARNING)
            elif found.fate is Fate.REGAIN:
                self._changes.tell(drone, found, Severity.CAUTION)
                take_back(drone, campaign.state, stopped=self._emergency.stops(drone.system_id))
            else:
                self._changes.drop(campaign, drone, found)

    def _motor(self, campaign: Campaign, drone: Drone, status: VehicleStatus) -> DropOut | None:
        """A failed motor in the slots and in the launch; one that is on its way home already only becomes slow."""
        found = motor_failed(status)
        if found is None or drone.active or campaign.state is CampaignState.LAUNCHING:
            return found
        if slow_down(drone):
            self._changes.tell(drone, found, Severity.WARNING)
        return None

    def _battery(self, campaign: Campaign, drone: Drone) -> None:
        """One that is stopped, or waits over its pad, is not brought down by us: told once while a person still can."""
        stopped = self._emergency.stops(drone.system_id)
        if not stopped and drone.waits_for is None:
            drone.low_told = False
            return
        if drone.low_told or drone.status is None or drone.track is None or not drone.is_airborne:
            return
        reserve, pad_m = campaign.order.settings.battery_reserve, drone.pad_m or drone.launch_m
        low = battery_low(drone.status, drone.track, pad_m, campaign.scenario, reserve)
        if low is not None:
            what = "is stopped" if stopped else f"waits for drone {drone.waits_for} below it"
            help_ = "reset the stop, or order it to return or to land" if stopped else "bring the lower one down"
            words = f"drone {drone.system_id} {what} and {low.reason}; {help_}"
            self._log.event("drone.battery", words, Severity.WARNING, drone.system_id)
            drone.low_told = True

    def run_scripts(self, campaign: Campaign, now_s: float) -> None:
        """One tick of every script that nobody stopped."""
        order, size_m = campaign.order, campaign.scenario.area.size_m
        crew = Crew(campaign.drones, self._changes, order.settings, size_m, campaign.bystanders)
        for drone in campaign.drones:
            if drone.control is Control.RELEASED or drone.script.finished or self._emergency.stops(drone.system_id):
                continue
            waited_for = drone.waits_for
            failure = drone.script.run(drone, crew, now_s)
            if drone.waits_for not in {None, waited_for}:
                self._tell_wait(drone)
            for verdict in drone.take_verdicts():
                self._log.verdict(verdict)
            if failure is not None:
                self._script_failed(campaign, drone, failure.reason)
            else:
                drone.halted = drone.halted and not drone.script.finished

    def _script_failed(self, campaign: Campaign, drone: Drone, reason: str) -> None:
        if campaign.state is CampaignState.LAUNCHING:
            self._changes.fail(campaign, reason)
        elif drone.control is Control.AUTOPILOT:
            self._log.event("drone.lost", f"{reason}; it needs a pilot", Severity.WARNING, system_id=drone.system_id)
            self._changes.drop(campaign, drone, DropOut(Fate.RELEASE, reason))
        else:
            self._log.event("drone.return", f"{reason}; ordered to return by itself", Severity.WARNING, drone.system_id)
            order_return(drone)
            if campaign.state is not CampaignState.RECOVERING and not anyone_left(campaign):
                self._changes.fail(campaign, f"no drone is left: {reason}")

    def _tell_wait(self, drone: Drone) -> None:
        words = (
            f"drone {drone.system_id} waits over its pad: drone {drone.waits_for} is in the air below it; bring it down"
        )
        self._log.event("drone.waits", words, Severity.CAUTION, drone.system_id)
