"""The mission manager: one campaign at a time, from standing drones to standing drones.

``step`` is called at every tick and returns the setpoints that passed the gate. Every change of state is recorded
before it acts. A fault of one drone is that drone's; a fault of all is the campaign's, and everybody goes home.
"""

import math
from collections.abc import Mapping

from gcs.mission.campaign import Campaign
from gcs.mission.campaign_log import CampaignLog
from gcs.mission.changes import Changes, anyone_left, bring_all_down
from gcs.mission.drone import Control
from gcs.mission.emergency import EmergencyStop
from gcs.mission.fates import after_stop, halt
from gcs.mission.hands import Hands
from gcs.mission.observing import observe
from gcs.mission.order import CampaignOrder
from gcs.mission.progress import Progress
from gcs.mission.reopening import is_due, reopen
from gcs.mission.resume import Resumption
from gcs.mission.script import Script
from gcs.mission.setpoints import fleet_setpoints
from gcs.mission.states import IN_FLIGHT, Trigger, is_allowed
from gcs.mission.steps import launch_steps
from gcs.mission.watch import DropOut, Fate
from gcs.ports import (
    CampaignSnapshot,
    CampaignState,
    FleetLink,
    Journal,
    Severity,
    VehicleStatus,
)
from gcs.safety.gate import SealedSetpoint

STALL_S = 0.8  # PX4 leaves OFFBOARD 1 s after the last setpoint (COM_OF_LOSS_T)


class Refused(Exception):  # noqa: N818  # an outcome for the operator, not a defect
    """The operator's wish does not fit the present state; says why."""


class MissionManager:
    """Called by the flight loop's thread only."""

    def __init__(self, link: FleetLink, journal: Journal, *, virtual: bool) -> None:
        self._link, self._virtual = link, virtual
        self._log = CampaignLog(journal)
        self.emergency = EmergencyStop()
        self._changes = Changes(link, self._log)
        self._hands = Hands(self._changes, self._log, self.emergency)
        self._progress = Progress(self._changes, self._log, virtual=virtual)
        self.campaign: Campaign | None = None
        self.vehicles: Mapping[int, VehicleStatus] = {}  # as seen at the newest step
        self._now_s = 0.0
        self._taken_up_s = 0.0
        self._stalled_s = -math.inf

    # --- what the operator may ask --------------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """A campaign has drones in its hands."""
        return self.campaign is not None and self.campaign.state in IN_FLIGHT

    def start(self, order: CampaignOrder, now_s: float, actor: str = "system") -> None:
        """Begin to launch; raises :class:`Refused` while another campaign flies or the stop is latched."""
        self._at(now_s)
        if self.busy:
            raise Refused(f"campaign {self._need().order.name!r} is being flown; abort it or wait for its end")
        if any(map(self.emergency.stops, order.system_ids)):
            raise Refused("the emergency stop is latched; reset it first")
        self.campaign = self._log.campaign = Campaign(order, self._link.vehicles())
        self._changes.move(self.campaign, Trigger.START, "", actor)
        self._progress.begin_policy(self.campaign)
        for drone in self.campaign.drones:
            drone.script = Script(launch_steps(order.settings.ready_timeout_s))

    def take_up(self, order: CampaignOrder, resumption: Resumption, now_s: float) -> None:
        """Go on with a campaign of a process before; its drones are told nothing until all have been heard."""
        self._at(now_s)
        self.campaign = self._log.campaign = Campaign(order, self._link.vehicles(), resumption)
        self._taken_up_s = now_s
        self._progress.begin_policy(self.campaign)

    def pause(self, now_s: float, actor: str) -> None:
        """Hold in place; the slot clock stops."""
        self._at(now_s)
        campaign = self._operator(Trigger.PAUSE, actor)
        assert campaign.slots is not None
        campaign.slots.pause(now_s)

    def resume(self, now_s: float, actor: str) -> None:
        """Go on with the slot; drones that the emergency stop halted are regained first."""
        self._at(now_s)
        if self.emergency.latched:
            raise Refused("the emergency stop is latched; reset it first")
        campaign = self._need()
        if any(drone.halted and drone.active for drone in campaign.drones):
            raise Refused("drones are still being taken over after the emergency stop; try again in a few seconds")
        self._operator(Trigger.RESUME, actor)
        assert campaign.slots is not None
        campaign.slots.resume(now_s)

    def abort(self, now_s: float, actor: str, reason: str = "aborted by the operator") -> None:
        """Everyone returns and lands."""
        self._at(now_s)
        if self.emergency.latched:
            reason = f"{reason}; everyone holds until the emergency stop is reset, then comes home"
        campaign = self._operator(Trigger.ABORT, actor, reason)
        if campaign.state is CampaignState.RECOVERING:
            bring_all_down(campaign)

    def stop(self, now_s: float, actor: str, system_id: int | None = None) -> None:
        """Emergency stop: everyone holds, or one drone does; latched."""
        self._at(now_s)
        who = "" if system_id is None else f" of drone {system_id}"
        self._log.event("safety.stop", f"emergency stop{who}", Severity.WARNING, system_id, actor=actor)
        self.emergency.press(system_id)
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT:
            return
        for drone in campaign.drones:
            if drone.control is Control.RELEASED or not self.emergency.stops(drone.system_id):
                continue
            halt(drone, alone=system_id is not None)
        if campaign.resumption is not None:
            return
        if system_id is None and campaign.state is CampaignState.FLYING:
            self.pause(now_s, actor)
        elif system_id is not None and campaign.state is CampaignState.LAUNCHING and self.holds(system_id):
            self._changes.fail(campaign, f"drone {system_id} was stopped during the launch")

    def reset_stop(self, now_s: float, actor: str, system_id: int | None = None) -> None:
        """Take the latch off: halted drones are taken over again and hold; a launch that was stopped goes home."""
        self._at(now_s)
        if system_id is not None and self.emergency.latched:
            raise Refused(f"all drones are stopped, drone {system_id} with them; reset the emergency stop of all")
        who = "" if system_id is None else f" of drone {system_id}"
        self._log.event("safety.stop_reset", f"emergency stop{who} reset", Severity.CAUTION, system_id, actor=actor)
        self.emergency.reset(system_id)
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT or campaign.resumption is not None:
            return
        if system_id is None and campaign.state is CampaignState.LAUNCHING:
            self._changes.fail(campaign, "stopped during the launch")
            return
        for drone in campaign.drones:
            if not self.emergency.stops(drone.system_id) and (drone.halted or drone.stopped):
                after_stop(drone, campaign.state)

    def release(self, system_id: int, now_s: float, reason: str) -> None:
        """Hands off one drone: a person or its failsafe flies it now; the rest go on."""
        self._at(now_s)
        campaign = self.campaign
        if campaign is None:
            return
        if campaign.resumption is not None:  # it is left out when the others are taken over
            campaign.resumption = campaign.resumption.without(system_id)
            words = f"drone {system_id}: {reason}"
            self._log.event("drone.release", words, Severity.WARNING, system_id)
            return
        for drone in campaign.drones:
            if drone.system_id == system_id and drone.control is not Control.RELEASED:
                self._changes.drop(campaign, drone, DropOut(Fate.RELEASE, reason))

    def holds(self, system_id: int) -> bool:
        """The drone is in the hands of a campaign."""
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT:
            return False
        return any(d.system_id == system_id and d.control is not Control.RELEASED for d in campaign.drones)

    # --- one tick -------------------------------------------------------------------------------------------------

    def step(self, now_s: float) -> list[SealedSetpoint]:
        """Advance the campaign to ``now_s``; the setpoints to send."""
        if now_s - self._now_s > STALL_S:
            self._stalled_s = now_s
        self._at(now_s)
        vehicles = self.vehicles = self._link.vehicles()
        for verdict in self.emergency.step(vehicles, self._link, now_s):
            self._log.event("command.verdict", f"hold: {verdict.result}", system_id=verdict.command.system_id)
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT:
            return []
        observe(campaign, vehicles, now_s, self._log)
        if campaign.resumption is not None:
            if not is_due(campaign, campaign.resumption, now_s - self._taken_up_s, now_s):
                return []
            self._reopen(campaign)
        self._hands.watch(campaign, now_s, self._stalled_s)
        if not self.emergency.latched:
            self._hands.run_scripts(campaign, now_s)
            self._progress.advance(campaign, now_s)
        self._log.keep(campaign)
        return self._setpoints(campaign, now_s) if campaign.state in IN_FLIGHT else []

    def holding(self, now_s: float) -> list[SealedSetpoint]:
        """Zero velocity for all that are ours: what is sent while :meth:`step` fails."""
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT:
            return []
        observe(campaign, self._link.vehicles(), now_s, self._log)
        return fleet_setpoints(campaign, now_s, lambda _: True)

    def snapshot(self, now_s: float) -> CampaignSnapshot | None:
        """The campaign as it stands, frozen."""
        return self.campaign.snapshot(now_s) if self.campaign is not None else None

    def _at(self, now_s: float) -> None:
        self._now_s = self._log.now_s = now_s

    def _reopen(self, campaign: Campaign) -> None:
        """Go on with what another process flew, or bring everyone home when going on is impossible."""
        found = reopen(campaign, self._log, self._now_s, self.emergency.stops, virtual=self._virtual)
        if campaign.state is CampaignState.RECOVERING:
            return
        if found.going_home:
            self._changes.fail(campaign, found.going_home)
        elif campaign.slots is not None and not anyone_left(campaign):
            reason = "; ".join(found.lost) or "all were going home"
            self._changes.fail(campaign, f"no drone is left after the restart: {reason}")
        elif campaign.state is CampaignState.LAUNCHING and found.lost:
            self._changes.fail(campaign, found.lost[0])
        elif found.flying and self.emergency.latched:
            self.pause(self._now_s, "system")
        elif campaign.slots is not None and campaign.slots.finished:
            self._progress.end_slots(campaign)
        else:
            self._progress.check_batteries(campaign)

    def _setpoints(self, campaign: Campaign, now_s: float) -> list[SealedSetpoint]:
        sealed = fleet_setpoints(campaign, now_s, self.emergency.stops)
        campaign.setpoints.add(sealed, now_s)
        for safe in sealed:
            self._log.gate(campaign, safe)
        return sealed

    def _operator(self, trigger: Trigger, actor: str, reason: str = "") -> Campaign:
        """A person's wish, done where the state allows it; raises :class:`Refused` where not."""
        campaign = self.campaign
        if campaign is None:
            raise Refused(f"there is no campaign to {trigger}")
        if campaign.resumption is not None:
            raise Refused("the campaign is being taken up after a restart; try again in a few seconds")
        if not is_allowed(campaign.state, trigger):
            raise Refused(f"a campaign that is {campaign.state} cannot {trigger}")
        self._changes.move(campaign, trigger, reason, actor)
        return campaign

    def _need(self) -> Campaign:
        if self.campaign is None:
            raise Refused("there is no campaign")
        return self.campaign
