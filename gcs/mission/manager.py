"""The mission manager: one campaign at a time, from standing drones to standing drones.

``step`` is called at every tick and returns the setpoints that passed the gate. Every change of state is recorded
before it acts. A fault of one drone is that drone's; a fault of all is the campaign's, and everybody goes home.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

from gcs.fleet.track import make_track
from gcs.mission.aftermath import COMING_DOWN_S, ending_of, is_coming_down, left_in_the_air
from gcs.mission.campaign import Campaign
from gcs.mission.campaign_log import CampaignLog
from gcs.mission.custody import is_unreachable, judge_custody, link_gap
from gcs.mission.drone import Control, Drone
from gcs.mission.emergency import EmergencyStop
from gcs.mission.fates import after_stop, bring_down, halt, let_go, order_return, send_home, take_back
from gcs.mission.order import CampaignOrder
from gcs.mission.reopening import is_due, reopen
from gcs.mission.resume import Resumption
from gcs.mission.script import Crew, Script
from gcs.mission.setpoints import fleet_setpoints
from gcs.mission.slot_flight import SlotFlight
from gcs.mission.states import ENDINGS, IN_FLIGHT, Trigger, is_allowed, next_state
from gcs.mission.steps import launch_steps
from gcs.mission.watch import DropOut, Fate, battery_low, motor_failed, position_lost
from gcs.ports import (
    CampaignSnapshot,
    CampaignState,
    CommandKind,
    CommandTicket,
    FleetLink,
    Journal,
    Severity,
    VehicleCommand,
    VehicleStatus,
)
from gcs.safety.gate import SealedSetpoint

NEVER_TWICE = frozenset({CommandKind.ARM, CommandKind.TAKEOFF})  # worth a wait for the store; a landing is not
STALL_S = 0.8  # PX4 leaves OFFBOARD 1 s after the last setpoint (COM_OF_LOSS_T)


class Refused(Exception):  # noqa: N818  # an outcome for the operator, not a defect
    """The operator's wish does not fit the present state; says why."""


class MissionManager:
    """Called by the flight loop's thread only."""

    def __init__(self, link: FleetLink, journal: Journal, *, virtual: bool) -> None:
        self._link, self._virtual = link, virtual
        self._log = CampaignLog(journal)
        self.emergency = EmergencyStop()
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
        self._move(Trigger.START, "", actor)
        self._begin_policy(self.campaign)
        for drone in self.campaign.drones:
            drone.script = Script(launch_steps(order.settings.ready_timeout_s))

    def take_up(self, order: CampaignOrder, resumption: Resumption, now_s: float) -> None:
        """Go on with a campaign of a process before; its drones are told nothing until all have been heard."""
        self._at(now_s)
        self.campaign = self._log.campaign = Campaign(order, self._link.vehicles(), resumption)
        self._taken_up_s = now_s
        self._begin_policy(self.campaign)

    def pause(self, now_s: float, actor: str) -> None:
        """Hold in place; the slot clock stops."""
        self._at(now_s)
        self._operator(Trigger.PAUSE, actor)
        slots = self._need().slots
        assert slots is not None
        slots.pause(now_s)

    def resume(self, now_s: float, actor: str) -> None:
        """Go on with the slot; drones that the emergency stop halted are regained first."""
        self._at(now_s)
        if self.emergency.latched:
            raise Refused("the emergency stop is latched; reset it first")
        campaign = self._need()
        if any(drone.halted for drone in campaign.drones):
            raise Refused("drones are still being taken over after the emergency stop; try again in a few seconds")
        self._operator(Trigger.RESUME, actor)
        assert campaign.slots is not None
        campaign.slots.resume(now_s)

    def abort(self, now_s: float, actor: str, reason: str = "aborted by the operator") -> None:
        """Everyone returns and lands."""
        self._at(now_s)
        self._operator(Trigger.ABORT, actor, reason)
        if self._need().state is CampaignState.RECOVERING:
            self._begin_recovery()

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
            self._fail(f"drone {system_id} was stopped during the launch")

    def reset_stop(self, now_s: float, actor: str, system_id: int | None = None) -> None:
        """Take the latch off: halted drones are taken over again and hold; a launch that was stopped goes home."""
        self._at(now_s)
        who = "" if system_id is None else f" of drone {system_id}"
        self._log.event("safety.stop_reset", f"emergency stop{who} reset", Severity.CAUTION, system_id, actor=actor)
        self.emergency.reset(system_id)
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT or campaign.resumption is not None:
            return
        if system_id is None and campaign.state is CampaignState.LAUNCHING:
            self._fail("stopped during the launch")
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
        for drone in campaign.drones:
            if drone.system_id == system_id and drone.control is not Control.RELEASED:
                self._drop(drone, DropOut(Fate.RELEASE, reason))

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
        self._observe(campaign, vehicles, now_s)
        if campaign.resumption is not None:
            if not is_due(campaign, campaign.resumption, now_s - self._taken_up_s, now_s):
                return []
            self._reopen(campaign)
        self._watch(campaign, now_s)
        if not self.emergency.latched:
            self._run_scripts(campaign, now_s)
            self._advance(campaign, now_s)
        self._log.keep(campaign)
        return self._setpoints(campaign, now_s) if campaign.state in IN_FLIGHT else []

    def holding(self, now_s: float) -> list[SealedSetpoint]:
        """Zero velocity for all that are ours: what is sent while :meth:`step` fails."""
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT:
            return []
        self._observe(campaign, self._link.vehicles(), now_s)
        return fleet_setpoints(campaign, now_s, lambda _: True)

    def snapshot(self, now_s: float) -> CampaignSnapshot | None:
        """The campaign as it stands, frozen."""
        return self.campaign.snapshot(now_s) if self.campaign is not None else None

    def _at(self, now_s: float) -> None:
        self._now_s = self._log.now_s = now_s

    def _observe(self, campaign: Campaign, vehicles: Mapping[int, VehicleStatus], now_s: float) -> None:
        frame = campaign.scenario.area.frame
        for drone in campaign.drones:
            status = vehicles.get(drone.system_id)
            if status is None:
                drone.gap_s = now_s
                continue
            drone.status = status
            drone.track = make_track(status, frame, now_s) or drone.track
            if link_gap(status, now_s):
                drone.gap_s = now_s
            self._doubt_position(drone, status)
        if campaign.slots is not None and not campaign.slots.finished:
            campaign.slots.measure(now_s)
        in_air = [d.track for d in campaign.drones if d.track is not None and (d.active or d.is_airborne)]
        campaign.monitor.tick(in_air)

    def _doubt_position(self, drone: Drone, status: VehicleStatus) -> None:
        """A place that the vehicle itself does not trust is as good as an old one: nobody steers by it."""
        why = position_lost(status) if drone.is_airborne else ""
        if why and drone.track is not None:
            drone.track = replace(drone.track, age_s=math.inf)
        if bool(why) != drone.doubted:
            drone.doubted = bool(why)
            words = f"{why}; it is told to hold and serves nobody" if why else "its position is good again"
            kind, severity = (
                ("drone.position_lost", Severity.WARNING) if why else ("drone.position_back", Severity.INFO)
            )
            self._log.event(kind, f"drone {drone.system_id}: {words}", severity, drone.system_id)

    def _reopen(self, campaign: Campaign) -> None:
        """Go on with what another process flew, or bring everyone home when going on is impossible."""
        found = reopen(campaign, self._log, self._now_s, self.emergency.stops, virtual=self._virtual)
        if campaign.state is CampaignState.RECOVERING:
            return
        if found.going_home:
            self._fail(found.going_home)
        elif campaign.slots is not None and not any(d.active or d.rejoins for d in campaign.drones):
            self._fail(f"no drone is left after the restart: {'; '.join(found.lost) or 'all were going home'}")
        elif campaign.state is CampaignState.LAUNCHING and found.lost:
            self._fail(found.lost[0])
        elif found.flying and self.emergency.latched:
            self.pause(self._now_s, "system")
        elif campaign.slots is not None and campaign.slots.finished:
            self._move(Trigger.LAST_SLOT)
            self._begin_recovery()
        else:
            self._check_batteries(campaign)

    def _watch(self, campaign: Campaign, now_s: float) -> None:
        """Who flies each drone that is ours."""
        for drone in campaign.drones:
            if drone.control is Control.RELEASED or drone.landed:
                continue
            found = judge_custody(drone, campaign.state, now_s, self._stalled_s)
            if found is None and drone.active and drone.status is not None:
                found = motor_failed(drone.status)
            heard = drone.silent_s is not None and not is_unreachable(drone, now_s)
            if found is None and not heard:
                continue
            if heard:
                drone.silent_s = None
            if found is None:
                self._log.event("drone.heard", f"drone {drone.system_id} is heard again", system_id=drone.system_id)
            elif found.fate is Fate.SILENT:
                drone.silent_s = now_s
                self._tell(drone, found, Severity.WARNING)
            elif found.fate is Fate.REGAIN:
                self._tell(drone, found, Severity.CAUTION)
                take_back(drone, campaign.state, stopped=self.emergency.stops(drone.system_id))
            else:
                self._drop(drone, found)

    def _run_scripts(self, campaign: Campaign, now_s: float) -> None:
        crew = Crew(campaign.drones, self, campaign.order.settings, campaign.scenario.area.size_m)
        for drone in campaign.drones:
            if drone.control is Control.RELEASED or drone.script.finished or self.emergency.stops(drone.system_id):
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
            self._fail(reason)
        elif drone.control is Control.AUTOPILOT:
            self._log.event("drone.lost", f"{reason}; it needs a pilot", Severity.WARNING, system_id=drone.system_id)
            self._drop(drone, DropOut(Fate.RELEASE, reason))
        else:
            self._log.event("drone.return", f"{reason}; ordered to return by itself", Severity.WARNING, drone.system_id)
            order_return(drone)
            if campaign.state is not CampaignState.RECOVERING and not _anyone_left(campaign):
                self._fail(f"no drone is left: {reason}")

    def _advance(self, campaign: Campaign, now_s: float) -> None:
        """What the present state does at each tick."""
        match campaign.state:
            case CampaignState.LAUNCHING if all(drone.script.finished for drone in campaign.drones):
                self._begin_slots(campaign, now_s)
            case CampaignState.FLYING:
                self._fly(campaign, now_s)
            case CampaignState.RECOVERING if all(_is_settled(drone) for drone in campaign.drones):
                self._end(campaign, now_s)
            case _:
                pass

    def _end(self, campaign: Campaign, now_s: float) -> None:
        """Nothing is left to be done: everyone stands, or somebody was not seen to, and a person must know."""
        if campaign.settled_s is None:
            campaign.settled_s = now_s
        awaited = any(is_coming_down(drone, now_s) for drone in campaign.drones)
        if awaited and now_s - campaign.settled_s <= COMING_DOWN_S:
            return
        left = left_in_the_air(campaign.drones)
        self._log.setpoints(campaign, campaign.records[-1].slot + 1 if campaign.records else 0)
        self._move(ending_of(campaign.ending, left), "; ".join((*filter(None, [campaign.reason]), *left)))
        campaign.order.planner.close()

    def _begin_slots(self, campaign: Campaign, now_s: float) -> None:
        self._move(Trigger.LAUNCHED)
        for drone in campaign.drones:
            drone.active = True
        campaign.slots = SlotFlight(campaign.order, campaign.scenario, campaign.drones, now_s, virtual=self._virtual)
        self._log.slot(campaign, campaign.slots.latest)
        self._check_batteries(campaign)

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
            self._move(Trigger.LAST_SLOT)
            self._begin_recovery()
        else:
            self._check_batteries(campaign)

    def _begin_policy(self, campaign: Campaign) -> None:
        """Which policy, from which weights, begun with what, stands in the log before it decides anything."""
        order = campaign.order
        order.planner.begin(campaign.scenario, campaign.policy_seed)
        data = {**order.provenance, "policy": order.policy, "session": campaign.session, "seed": campaign.policy_seed}
        self._log.event("policy.begun", f"policy {order.policy} begins", data=data)

    def _check_batteries(self, campaign: Campaign) -> None:
        """Before each slot: who can fly it and still come home."""
        reserve = campaign.order.settings.battery_reserve
        for drone in campaign.drones:
            if not drone.active or drone.status is None or drone.track is None or drone.pad_m is None:
                continue
            dropout = battery_low(drone.status, drone.track, drone.pad_m, campaign.scenario, reserve)
            if dropout is not None:
                self._drop(drone, dropout)

    def _setpoints(self, campaign: Campaign, now_s: float) -> list[SealedSetpoint]:
        sealed = fleet_setpoints(campaign, now_s, self.emergency.stops)
        campaign.setpoints.add(sealed, now_s)
        for safe in sealed:
            self._log.gate(campaign, safe)
        return sealed

    def submit(self, command: VehicleCommand, now_s: float) -> CommandTicket:
        """An order of a script: in the log before it is sent, so that a restarted server knows of it."""
        message = f"drone {command.system_id} is ordered to {command.kind}"
        data = {"command": str(command.kind), "altitude_m": command.altitude_m}
        self._log.event("command.given", message, system_id=command.system_id, data=data)
        if command.kind in NEVER_TWICE:
            self._log.settle()
        return self._link.submit(command, now_s)

    # --- changes --------------------------------------------------------------------------------------------------

    def _tell(self, drone: Drone, found: DropOut, severity: Severity) -> None:
        kind, words = f"drone.{found.fate}", f"drone {drone.system_id}: {found.reason}"
        self._log.event(kind, words, severity, drone.system_id)

    def _tell_wait(self, drone: Drone) -> None:
        words = (
            f"drone {drone.system_id} waits over its pad: drone {drone.waits_for} is in the air below it; bring it down"
        )
        self._log.event("drone.waits", words, Severity.CAUTION, drone.system_id)

    def _drop(self, drone: Drone, dropout: DropOut) -> None:
        campaign = self._need()
        was_flying = campaign.state in {CampaignState.FLYING, CampaignState.PAUSED}
        drone.active, drone.rejoins, drone.reason = False, False, dropout.reason
        self._tell(drone, dropout, Severity.WARNING)
        if dropout.fate is Fate.GO_HOME:
            send_home(drone)
        else:
            if drone.silent_s is not None:  # it may hear us though we do not hear it
                self.submit(VehicleCommand(CommandKind.RETURN, drone.system_id, urgent=True), self._now_s)
            let_go(drone, follow=dropout.fate is Fate.FOLLOW)
            campaign.gate.forget(drone.system_id)
        if campaign.state is CampaignState.LAUNCHING:
            self._fail(f"drone {drone.system_id}: {dropout.reason}")
        elif was_flying and not _anyone_left(campaign):
            self._fail(f"no drone is left: drone {drone.system_id}: {dropout.reason}")

    def _fail(self, reason: str) -> None:
        self._move(Trigger.FAIL, reason)
        self._begin_recovery()

    def _begin_recovery(self) -> None:
        for drone in self._need().drones:
            bring_down(drone)

    def _operator(self, trigger: Trigger, actor: str, reason: str = "") -> None:
        campaign = self.campaign
        if campaign is None:
            raise Refused(f"there is no campaign to {trigger}")
        if campaign.resumption is not None:
            raise Refused("the campaign is being taken up after a restart; try again in a few seconds")
        if not is_allowed(campaign.state, trigger):
            raise Refused(f"a campaign that is {campaign.state} cannot {trigger}")
        self._move(trigger, reason, actor)

    def _move(self, trigger: Trigger, reason: str = "", actor: str = "system") -> None:
        """Record the transition, durably, before anything comes of it."""
        campaign = self._need()
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

    def _need(self) -> Campaign:
        if self.campaign is None:
            raise Refused("there is no campaign")
        return self.campaign


def _anyone_left(campaign: Campaign) -> bool:
    """Somebody flies the slots, or will again when a person lets it."""
    return any(drone.active or drone.rejoins for drone in campaign.drones)


def _is_settled(drone: Drone) -> bool:
    """Down, or not ours any more."""
    return drone.landed or drone.control is Control.RELEASED
