"""A campaign's changes of state and its drones' changes of hands: in the log before anything comes of them."""

from gcs.mission.campaign import Campaign
from gcs.mission.campaign_log import CampaignLog
from gcs.mission.drone import Drone
from gcs.mission.fates import bring_down, let_go, send_home
from gcs.mission.states import ENDINGS, Trigger, next_state
from gcs.mission.watch import DropOut, Fate
from gcs.ports import CampaignState, CommandKind, CommandTicket, FleetLink, Severity, VehicleCommand

NEVER_TWICE = frozenset({CommandKind.ARM, CommandKind.TAKEOFF})  # worth a wait for the store; a landing is not


class Changes:
    """One a manager; the log holds the time."""

    def __init__(self, link: FleetLink, log: CampaignLog) -> None:
        self._link, self._log = link, log

    def move(self, campaign: Campaign, trigger: Trigger, reason: str = "", actor: str = "system") -> None:
        """Record the transition, durably, before anything comes of it."""
        state = next_state(campaign.state, trigger)
        severity = Severity.WARNING if trigger in {Trigger.FAIL, Trigger.LANDED_FAILED} else Severity.INFO
        words = f"{campaign.state} -> {state}" + (f": {reason}" if reason else "")
        data = {"state": str(state), "trigger": str(trigger)}
        self._log.event("campaign.state", words, severity, actor=actor, data=data)
        campaign.state = state
        campaign.reason = reason or campaign.reason
        if trigger in ENDINGS:
            campaign.ending = ENDINGS[trigger]
        self._log.keep(campaign)
        self._log.settle()

    def fail(self, campaign: Campaign, reason: str) -> None:
        """What is a fault of all: everybody goes home."""
        self.move(campaign, Trigger.FAIL, reason)
        bring_all_down(campaign)

    def drop(self, campaign: Campaign, drone: Drone, dropout: DropOut) -> None:
        """One drone leaves the slots; the rest go on, if there are any."""
        was_flying = campaign.state in {CampaignState.FLYING, CampaignState.PAUSED}
        drone.active, drone.rejoins, drone.reason = False, False, dropout.reason
        self.tell(drone, dropout, Severity.WARNING)
        if dropout.fate is Fate.GO_HOME:
            send_home(drone)
        else:
            if drone.silent_s is not None:  # it may hear us though we do not hear it
                self.submit(VehicleCommand(CommandKind.RETURN, drone.system_id, urgent=True), self._log.now_s)
            let_go(drone, follow=dropout.fate is Fate.FOLLOW)
            campaign.gate.forget(drone.system_id)
        if campaign.state is CampaignState.LAUNCHING:
            self.fail(campaign, f"drone {drone.system_id}: {dropout.reason}")
        elif was_flying and not anyone_left(campaign):
            self.fail(campaign, f"no drone is left: drone {drone.system_id}: {dropout.reason}")

    def tell(self, drone: Drone, found: DropOut, severity: Severity) -> None:
        """What was found of one drone, in the log."""
        kind, words = f"drone.{found.fate}", f"drone {drone.system_id}: {found.reason}"
        self._log.event(kind, words, severity, drone.system_id)

    def submit(self, command: VehicleCommand, now_s: float) -> CommandTicket:
        """An order of a script: in the log before it is sent, so that a restarted server knows of it."""
        message = f"drone {command.system_id} is ordered to {command.kind}"
        data = {"command": str(command.kind), "altitude_m": command.altitude_m}
        self._log.event("command.given", message, system_id=command.system_id, data=data)
        if command.kind in NEVER_TWICE:
            self._log.settle()
        return self._link.submit(command, now_s)


def bring_all_down(campaign: Campaign) -> None:
    """Everyone returns and lands."""
    for drone in campaign.drones:
        bring_down(drone)


def anyone_left(campaign: Campaign) -> bool:
    """Somebody flies the slots, or will again when a person lets it."""
    return any(drone.active or drone.rejoins for drone in campaign.drones)
