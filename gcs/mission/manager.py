"""The mission manager: one campaign at a time, from standing drones to standing drones.

``step`` is called at every tick and returns the setpoints that passed the gate. Every change of state is recorded
before it acts. A fault of one drone is that drone's; a fault of all is the campaign's, and everybody goes home.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

from gcs.fleet.track import make_track
from gcs.guidance.tracking import approach
from gcs.mission.campaign import Campaign
from gcs.mission.drone import Control, Drone
from gcs.mission.emergency import EmergencyStop
from gcs.mission.order import CampaignOrder
from gcs.mission.resume import PATIENCE_S, Resumption, has_reported, is_stream_lost, takeover
from gcs.mission.script import Crew, Script
from gcs.mission.slot_flight import FlownBefore, SlotFlight
from gcs.mission.states import ENDINGS, IN_FLIGHT, Trigger, is_allowed, next_state
from gcs.mission.steps import (
    DISARM_STEPS,
    HOME_STEPS,
    LAND_HERE_STEPS,
    REGAIN_STEPS,
    RETURN_STEPS,
    FlyTo,
    launch_steps,
)
from gcs.mission.watch import DropOut, Fate, battery_low, control_lost
from gcs.ports import (
    CampaignSnapshot,
    CampaignState,
    Checkpoint,
    CommandKind,
    CommandTicket,
    DroneCheckpoint,
    Event,
    FleetLink,
    Journal,
    Severity,
    SlotRecord,
    UavTrack,
    VehicleCommand,
    VehicleStatus,
    Verdict,
)
from gcs.safety.gate import GateAction, SealedSetpoint, Wish

GATE_QUIET_S = 5.0  # the gate has let a drone alone for so long: its next act is a new event
NEVER_TWICE = frozenset({CommandKind.ARM, CommandKind.TAKEOFF})  # worth a wait for the store; a landing is not
STALL_S = 0.8  # PX4 leaves OFFBOARD 1 s after the last setpoint (COM_OF_LOSS_T)
STALL_MEMORY_S = 4.0  # after a stall: a mode change shows in a heartbeat, once a second


class Refused(Exception):  # noqa: N818  # an outcome for the operator, not a defect
    """The operator's wish does not fit the present state; says why."""


class MissionManager:
    """Called by the flight loop's thread only."""

    def __init__(self, link: FleetLink, journal: Journal, *, virtual: bool) -> None:
        self._link, self._journal, self._virtual = link, journal, virtual
        self.emergency = EmergencyStop()
        self.campaign: Campaign | None = None
        self.vehicles: Mapping[int, VehicleStatus] = {}  # as seen at the newest step
        self._now_s = 0.0
        self._taken_up_s = 0.0
        self._stalled_s = -math.inf
        self._kept: Checkpoint | None = None

    # --- what the operator may ask --------------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """A campaign has drones in its hands."""
        return self.campaign is not None and self.campaign.state in IN_FLIGHT

    def start(self, order: CampaignOrder, now_s: float, actor: str = "system") -> None:
        """Begin to launch; raises :class:`Refused` while another campaign flies or the stop is latched."""
        self._now_s = now_s
        if self.busy:
            raise Refused(f"campaign {self._need().order.name!r} is being flown; abort it or wait for its end")
        if self.emergency.latched:
            raise Refused("the emergency stop is latched; reset it first")
        self.campaign = Campaign(order, self._link.vehicles())
        self._move(Trigger.START, "", actor)
        self._begin_policy(self.campaign)
        for drone in self.campaign.drones:
            drone.script = Script(launch_steps(order.settings.ready_timeout_s))

    def take_up(self, order: CampaignOrder, resumption: Resumption, now_s: float) -> None:
        """Go on with a campaign of a process before; its drones are told nothing until all have been heard."""
        self._now_s = now_s
        self.campaign = Campaign(order, self._link.vehicles(), resumption)
        self._taken_up_s = now_s
        self._begin_policy(self.campaign)

    def pause(self, now_s: float, actor: str) -> None:
        """Hold in place; the slot clock stops."""
        self._now_s = now_s
        self._operator(Trigger.PAUSE, actor)
        slots = self._need().slots
        assert slots is not None
        slots.pause(now_s)

    def resume(self, now_s: float, actor: str) -> None:
        """Go on with the slot; drones that the emergency stop halted are regained first."""
        self._now_s = now_s
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
        self._now_s = now_s
        self._operator(Trigger.ABORT, actor, reason)
        if self._need().state is CampaignState.RECOVERING:
            self._begin_recovery()

    def stop(self, now_s: float, actor: str) -> None:
        """Emergency stop: everyone holds, latched."""
        self._now_s = now_s
        self._event("safety.stop", "emergency stop", Severity.WARNING, actor=actor)
        self.emergency.press()
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT:
            return
        for drone in campaign.drones:
            drone.halted = drone.halted or drone.control is Control.GUIDED
        if campaign.state is CampaignState.FLYING and campaign.resumption is None:
            self.pause(now_s, actor)

    def reset_stop(self, now_s: float, actor: str) -> None:
        """Take the latch off: halted drones are taken over again and hold; a launch that was stopped goes home."""
        self._now_s = now_s
        self._event("safety.stop_reset", "emergency stop reset", Severity.CAUTION, actor=actor)
        self.emergency.reset()
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT:
            return
        if campaign.state is CampaignState.LAUNCHING:
            self._fail("stopped during the launch")
        elif campaign.state is CampaignState.RECOVERING:
            self._begin_recovery()
        else:
            for drone in campaign.drones:
                if drone.halted:
                    drone.script = Script(REGAIN_STEPS)

    def release(self, system_id: int, now_s: float, reason: str) -> None:
        """Hands off one drone: a person or its failsafe flies it now; the rest go on."""
        self._now_s = now_s
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
        self._now_s = now_s
        vehicles = self.vehicles = self._link.vehicles()
        for verdict in self.emergency.step(vehicles, self._link, now_s):
            self._event("command.verdict", f"hold: {verdict.result}", system_id=verdict.command.system_id)
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT:
            return []
        self._observe(campaign, vehicles, now_s)
        if campaign.resumption is not None and not self._resume(campaign, campaign.resumption, now_s):
            return []
        if not self.emergency.latched:
            self._watch(campaign, now_s)
            self._run_scripts(campaign, now_s)
            self._advance(campaign, now_s)
        self._keep(campaign)
        return self._setpoints(campaign, now_s) if campaign.state in IN_FLIGHT else []

    def snapshot(self, now_s: float) -> CampaignSnapshot | None:
        """The campaign as it stands, frozen."""
        return self.campaign.snapshot(now_s) if self.campaign is not None else None

    def _observe(self, campaign: Campaign, vehicles: Mapping[int, VehicleStatus], now_s: float) -> None:
        frame = campaign.scenario.area.frame
        for drone in campaign.drones:
            status = vehicles.get(drone.system_id)
            if status is not None:
                drone.status = status
                drone.track = make_track(status, frame, now_s) or drone.track
        if campaign.slots is not None and not campaign.slots.finished:
            campaign.slots.measure(now_s)
            campaign.monitor.tick([d.track for d in campaign.drones if d.active and d.track is not None])

    def _resume(self, campaign: Campaign, resumption: Resumption, now_s: float) -> bool:
        """True once the drones are in our hands again: everyone heard, or waited for long enough."""
        was = resumption.checkpoint
        if not has_reported(campaign.drones, was, now_s) and now_s - self._taken_up_s < PATIENCE_S:
            return False
        campaign.resumption = None
        for drone, then in zip(campaign.drones, was.drones, strict=True):
            self._take_over(campaign, drone, then)
        if resumption.records:
            paused = campaign.state is CampaignState.PAUSED
            start_s = now_s - was.slot_elapsed_s if paused else resumption.slot_start_s
            before = FlownBefore(resumption.records, start_s, paused)
            campaign.slots = SlotFlight(
                campaign.order, campaign.scenario, campaign.drones, now_s, virtual=self._virtual, before=before
            )
        self._go_on(campaign, resumption)
        return True

    def _take_over(self, campaign: Campaign, drone: Drone, then: DroneCheckpoint) -> None:
        fate = takeover(campaign.state, then, drone, self._now_s, campaign.order.settings.ready_timeout_s)
        drone.pad_m = then.pad_m or _home_of(drone, campaign)
        drone.control, drone.active, drone.landed = fate.control, fate.active, fate.landed
        drone.halted, drone.script, drone.reason = fate.halted, Script(fate.steps), fate.reason
        if drone.is_streamed and self.emergency.latched:  # regained when a person takes the stop off
            drone.control, drone.halted, drone.script = Control.GUIDED, True, Script(())
        if fate.reason and then.control != Control.RELEASED:
            message = f"drone {drone.system_id}: {fate.reason}"
            self._event("drone.release", message, Severity.WARNING, drone.system_id)

    def _go_on(self, campaign: Campaign, resumption: Resumption) -> None:
        """Close what went by, tell it, and go on; or bring everyone home when going on is impossible."""
        flying = campaign.state is CampaignState.FLYING
        missed = campaign.slots.catch_up(self._now_s) if flying and campaign.slots is not None else ()
        away_s = self._now_s - resumption.taken_s
        data = {"state": str(campaign.state), "away_s": away_s, "missed_slots": [record.slot for record in missed]}
        words = f"taken up again while {campaign.state}; slots that ended unwatched: {len(missed)}"
        self._event("campaign.resumed", words, Severity.CAUTION, data=data)
        for record in missed:
            self._record_slot(campaign, record)
        if campaign.state is CampaignState.RECOVERING:
            return
        lost = [drone.reason for drone in campaign.drones if drone.control is Control.RELEASED]
        if resumption.going_home:
            self._fail(resumption.going_home)
        elif campaign.slots is not None and not any(drone.active for drone in campaign.drones):
            self._fail(f"no drone is left after the restart: {'; '.join(lost) or 'all were going home'}")
        elif campaign.state is CampaignState.LAUNCHING and lost:
            self._fail(lost[0])
        elif flying and self.emergency.latched:
            self.pause(self._now_s, "system")
        elif campaign.slots is not None and campaign.slots.finished:
            self._move(Trigger.LAST_SLOT)
            self._begin_recovery()
        else:
            self._check_batteries(campaign)

    def _keep(self, campaign: Campaign) -> None:
        """A checkpoint when something in it changed but the time."""
        now = campaign.checkpoint(self._now_s)
        if self._kept is None or replace(now, slot_elapsed_s=self._kept.slot_elapsed_s) != self._kept:
            self._kept = now
            self._journal.checkpoint(now)

    def _watch(self, campaign: Campaign, now_s: float) -> None:
        for drone in campaign.drones:
            if drone.control is Control.GUIDED and not drone.halted and not drone.obeys_already:
                dropout = control_lost(drone.status, now_s)
                if dropout is not None and now_s - self._stalled_s < STALL_MEMORY_S and is_stream_lost(drone.status):
                    self._regain(campaign, drone)
                elif dropout is not None:
                    self._drop(drone, dropout)

    def _regain(self, campaign: Campaign, drone: Drone) -> None:
        """Our own loop stalled and the vehicle went where it goes without setpoints: no pilot asked for that."""
        message = f"drone {drone.system_id} lost our stream while this machine stalled; it is taken over again"
        self._event("drone.regain", message, Severity.CAUTION, drone.system_id)
        drone.forget_orders()
        after = {CampaignState.LAUNCHING: (FlyTo(home=False),), CampaignState.RECOVERING: HOME_STEPS}
        going_home = HOME_STEPS if not drone.active and not drone.script.finished else ()
        drone.script = Script((*REGAIN_STEPS, *after.get(campaign.state, going_home)))
        drone.halted = drone.active

    def _run_scripts(self, campaign: Campaign, now_s: float) -> None:
        crew = Crew(campaign.drones, self, campaign.order.settings, campaign.scenario.area.size_m)
        for drone in campaign.drones:
            if drone.control is Control.RELEASED or drone.script.finished:
                continue
            failure = drone.script.run(drone, crew, now_s)
            for verdict in drone.take_verdicts():
                self._note_verdict(verdict)
            if failure is not None:
                self._script_failed(campaign, drone, failure.reason)
            else:
                drone.halted = drone.halted and not drone.script.finished

    def _script_failed(self, campaign: Campaign, drone: Drone, reason: str) -> None:
        if campaign.state is CampaignState.LAUNCHING:
            self._fail(reason)
        elif drone.control is Control.AUTOPILOT:
            self._event("drone.lost", f"{reason}; it needs a pilot", Severity.WARNING, system_id=drone.system_id)
            self._drop(drone, DropOut(Fate.RELEASE, reason))
        else:
            self._event("drone.return", f"{reason}; ordered to return by itself", Severity.WARNING, drone.system_id)
            drone.script = Script(RETURN_STEPS)
            drone.control, drone.active, drone.halted = Control.AUTOPILOT, False, False
            if campaign.state is not CampaignState.RECOVERING and not any(d.active for d in campaign.drones):
                self._fail(f"no drone is left: {reason}")

    def _advance(self, campaign: Campaign, now_s: float) -> None:
        """What the present state does at each tick."""
        match campaign.state:
            case CampaignState.LAUNCHING if all(drone.script.finished for drone in campaign.drones):
                self._begin_slots(campaign, now_s)
            case CampaignState.FLYING:
                self._fly(campaign, now_s)
            case CampaignState.RECOVERING if all(_is_settled(drone) for drone in campaign.drones):
                self._close_setpoints(campaign, campaign.records[-1].slot + 1 if campaign.records else 0)
                self._move(campaign.ending, campaign.reason)
                campaign.order.planner.close()
            case _:
                pass

    def _begin_slots(self, campaign: Campaign, now_s: float) -> None:
        self._move(Trigger.LAUNCHED)
        for drone in campaign.drones:
            drone.active = True
        campaign.slots = SlotFlight(campaign.order, campaign.scenario, campaign.drones, now_s, virtual=self._virtual)
        self._record_slot(campaign, campaign.slots.latest)
        self._check_batteries(campaign)

    def _fly(self, campaign: Campaign, now_s: float) -> None:
        slots = campaign.slots
        assert slots is not None
        record, trouble = slots.step(now_s)
        for decided in slots.take_decided():
            self._journal.record_decision(campaign.order.campaign_id, campaign.signed(decided))
        if trouble is not None:
            self._event(trouble.kind, f"slot {slots.slot}: {trouble.reason}; the drones hold", Severity.CAUTION)
        if record is None:
            return
        self._record_slot(campaign, record)
        self._report_violations(campaign, record)
        if slots.finished:
            self._move(Trigger.LAST_SLOT)
            self._begin_recovery()
        else:
            self._check_batteries(campaign)

    def _record_slot(self, campaign: Campaign, record: SlotRecord) -> None:
        campaign.records.append(record)
        self._journal.record_slot(campaign.order.campaign_id, record)
        self._close_setpoints(campaign, record.slot)
        self._keep(campaign)
        self._journal.settle()

    def _close_setpoints(self, campaign: Campaign, slot: int) -> None:
        told = campaign.setpoints.close()
        if told:
            self._journal.record_setpoints(campaign.order.campaign_id, slot, told)

    def _begin_policy(self, campaign: Campaign) -> None:
        """Which policy, from which weights, begun with what, stands in the log before it decides anything."""
        order = campaign.order
        order.planner.begin(campaign.scenario, campaign.policy_seed)
        data = {**order.provenance, "policy": order.policy, "session": campaign.session, "seed": campaign.policy_seed}
        self._event("policy.begun", f"policy {order.policy} begins", data=data)

    def _report_violations(self, campaign: Campaign, record: SlotRecord) -> None:
        battery_j = campaign.scenario.battery_j
        added = campaign.monitor.end_slot([u.system_id for u in record.uavs if u.active and u.energy_j >= battery_j])
        broken = ", ".join(f"{rule} {count}" for rule, count in added.items() if count)
        if broken:
            self._event("safety.violation", f"slot {record.slot}: {broken}", Severity.WARNING, data=dict(added))

    def _check_batteries(self, campaign: Campaign) -> None:
        reserve = campaign.order.settings.battery_reserve
        for drone in campaign.drones:
            if drone.active and drone.status is not None and drone.track is not None and drone.pad_m is not None:
                dropout = battery_low(drone.status, drone.track, drone.pad_m, campaign.scenario, reserve)
                if dropout is not None:
                    self._drop(drone, dropout)

    # --- setpoints ------------------------------------------------------------------------------------------------

    def _setpoints(self, campaign: Campaign, now_s: float) -> list[SealedSetpoint]:
        wishes = [
            self._wish(campaign, drone, drone.track, now_s)
            for drone in campaign.drones
            if drone.is_streamed and drone.track is not None
        ]
        # A drone that its autopilot takes up or down levels off where it was told to: its climb is no threat.
        others = [
            replace(drone.track, vel_up_mps=0.0)
            for drone in campaign.drones
            if drone.track is not None and not drone.is_streamed and drone.is_airborne
        ]
        sealed = campaign.gate.judge(wishes, others)
        campaign.setpoints.add(sealed, now_s)
        for safe in sealed:
            self._note_gate(campaign, safe)
        return sealed

    def _wish(self, campaign: Campaign, drone: Drone, track: UavTrack, now_s: float) -> Wish:
        gains = campaign.order.settings.gains
        slots = campaign.slots
        in_slots = campaign.state in {CampaignState.FLYING, CampaignState.PAUSED} and drone.active
        if self.emergency.latched:
            here_m = (track.east_m, track.north_m)
            setpoint = approach(track, here_m, track.alt_home_m, campaign.scenario.max_speed_mps, gains)
        elif in_slots and slots is not None and not drone.halted:
            setpoint = slots.wish(drone, track, now_s)
        else:
            goal = drone.goal
            assert goal is not None
            setpoint = approach(track, goal.point_m, goal.alt_home_m, goal.speed_mps, gains)
        return Wish(setpoint, track)

    def _note_gate(self, campaign: Campaign, safe: SealedSetpoint) -> None:
        """One event when the gate begins to act on a drone, none while it goes on with short breaks."""
        if safe.action is GateAction.PASSED or "limit" in safe.reason:
            return
        system_id = safe.setpoint.system_id
        reason, last_s = campaign.gate_acts.get(system_id, ("", -math.inf))
        if reason != safe.reason or self._now_s - last_s > GATE_QUIET_S:
            kind = f"gate.{safe.action}"
            self._event(kind, f"drone {system_id} {safe.action} by the gate: {safe.reason}", system_id=system_id)
        campaign.gate_acts[system_id] = (safe.reason, self._now_s)

    def submit(self, command: VehicleCommand, now_s: float) -> CommandTicket:
        """An order of a script: in the log before it is sent, so that a restarted server knows of it."""
        message = f"drone {command.system_id} is ordered to {command.kind}"
        data = {"command": str(command.kind), "altitude_m": command.altitude_m}
        self._event("command.given", message, system_id=command.system_id, data=data)
        if command.kind in NEVER_TWICE:
            self._journal.settle()
        return self._link.submit(command, now_s)

    def _note_verdict(self, verdict: Verdict) -> None:
        command = verdict.command
        words = f": {verdict.reason}" if verdict.reason else ""
        data = {"command": str(command.kind), "result": str(verdict.result), "attempts": verdict.attempts}
        message = f"drone {command.system_id} {command.kind}: {verdict.result}{words}"
        self._event("command.verdict", message, system_id=command.system_id, data=data | {"reason": verdict.reason})

    # --- changes --------------------------------------------------------------------------------------------------

    def _drop(self, drone: Drone, dropout: DropOut) -> None:
        campaign = self._need()
        was_flying = campaign.state in {CampaignState.FLYING, CampaignState.PAUSED}
        drone.active, drone.reason = False, dropout.reason
        self._event(
            f"drone.{dropout.fate}", f"drone {drone.system_id}: {dropout.reason}", Severity.WARNING, drone.system_id
        )
        if dropout.fate is Fate.RELEASE:
            drone.control, drone.script = Control.RELEASED, Script(())
            campaign.gate.forget(drone.system_id)
        else:
            drone.script = Script(HOME_STEPS)
        if campaign.state is CampaignState.LAUNCHING:
            self._fail(f"drone {drone.system_id}: {dropout.reason}")
        elif was_flying and not any(d.active for d in campaign.drones):
            self._fail(f"no drone is left: drone {drone.system_id}: {dropout.reason}")

    def _fail(self, reason: str) -> None:
        self._move(Trigger.FAIL, reason)
        self._begin_recovery()

    def _begin_recovery(self) -> None:
        """Bring every drone that is ours down, each from where its launch or flight has got to."""
        for drone in self._need().drones:
            drone.active = False
            if drone.control is Control.RELEASED or drone.landed:
                continue
            drone.forget_orders()
            if drone.halted or drone.control is Control.STREAM:
                drone.script, drone.halted = Script((*REGAIN_STEPS, *HOME_STEPS)), False
            elif drone.control is Control.GUIDED:
                drone.script = Script(HOME_STEPS)
            elif drone.is_airborne:
                drone.script = Script(LAND_HERE_STEPS)
                drone.control = Control.AUTOPILOT
            elif drone.status is not None and drone.status.armed:
                drone.script = Script(DISARM_STEPS)
            else:
                drone.script, drone.landed = Script(()), True

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
        self._event("campaign.state", words, severity, actor=actor, data={"state": str(state), "trigger": str(trigger)})
        campaign.state = state
        campaign.reason = reason or campaign.reason
        if trigger in ENDINGS:
            campaign.ending = ENDINGS[trigger]
        self._keep(campaign)
        self._journal.settle()  # a stalled store is told by the journal and never waited for

    def _event(
        self,
        kind: str,
        message: str,
        severity: Severity = Severity.INFO,
        system_id: int | None = None,
        *,
        actor: str = "system",
        data: Mapping[str, object] | None = None,
    ) -> None:
        campaign_id = self.campaign.order.campaign_id if self.campaign is not None else None
        event = Event(self._now_s, kind, message, severity, campaign_id, system_id, actor, data or {})
        self._journal.record(event)

    def _need(self) -> Campaign:
        if self.campaign is None:
            raise Refused("there is no campaign")
        return self.campaign


def _is_settled(drone: Drone) -> bool:
    """Down, or not ours any more."""
    return drone.landed or drone.control is Control.RELEASED


def _home_of(drone: Drone, campaign: Campaign) -> tuple[float, float] | None:
    """The pad of a drone whose launch was under way: the vehicle's own home."""
    status = drone.status
    if status is None or status.home_lat_deg is None or status.home_lon_deg is None:
        return None
    east_m, north_m = campaign.scenario.area.frame.to_enu_m(status.home_lat_deg, status.home_lon_deg)
    return float(east_m), float(north_m)
