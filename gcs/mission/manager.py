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
from gcs.mission.script import Crew, Script
from gcs.mission.slot_flight import SlotFlight
from gcs.mission.states import ENDINGS, IN_FLIGHT, Trigger, is_allowed, next_state
from gcs.mission.steps import (
    DISARM_STEPS,
    HOME_STEPS,
    LAND_HERE_STEPS,
    REGAIN_STEPS,
    RETURN_STEPS,
    launch_steps,
)
from gcs.mission.watch import DropOut, Fate, battery_low, control_lost
from gcs.ports import (
    CampaignSnapshot,
    CampaignState,
    Event,
    FleetLink,
    Journal,
    Severity,
    SlotRecord,
    UavTrack,
    VehicleStatus,
)
from gcs.safety.gate import GateAction, SealedSetpoint, Wish

GATE_QUIET_S = 5.0  # the gate has let a drone alone for so long: its next act is a new event


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
        order.planner.begin(self.campaign.scenario, order.seed)
        self._move(Trigger.START, "", actor)
        for drone in self.campaign.drones:
            drone.script = Script(launch_steps(order.settings.ready_timeout_s))

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
        if campaign.state is CampaignState.FLYING:
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
        self._now_s = now_s
        vehicles = self.vehicles = self._link.vehicles()
        for verdict in self.emergency.step(vehicles, self._link, now_s):
            self._event("command.verdict", f"hold: {verdict.result}", system_id=verdict.command.system_id)
        campaign = self.campaign
        if campaign is None or campaign.state not in IN_FLIGHT:
            return []
        self._observe(campaign, vehicles, now_s)
        if not self.emergency.latched:
            self._watch(campaign, now_s)
            self._run_scripts(campaign, now_s)
            self._advance(campaign, now_s)
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

    def _watch(self, campaign: Campaign, now_s: float) -> None:
        for drone in campaign.drones:
            obeys = drone.status is not None and drone.status.mode is drone.ordered_mode
            if drone.control is Control.GUIDED and not drone.halted and not obeys:
                dropout = control_lost(drone.status, now_s)
                if dropout is not None:
                    self._drop(drone, dropout)

    def _run_scripts(self, campaign: Campaign, now_s: float) -> None:
        crew = Crew(campaign.drones, self._link, campaign.order.settings, campaign.scenario.area.size_m)
        for drone in campaign.drones:
            if drone.control is Control.RELEASED or drone.script.finished:
                continue
            failure = drone.script.run(drone, crew, now_s)
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
            drone.control = Control.AUTOPILOT

    def _advance(self, campaign: Campaign, now_s: float) -> None:
        """What the present state does at each tick."""
        match campaign.state:
            case CampaignState.LAUNCHING if all(drone.script.finished for drone in campaign.drones):
                self._begin_slots(campaign, now_s)
            case CampaignState.FLYING:
                self._fly(campaign, now_s)
            case CampaignState.RECOVERING if all(_is_settled(drone) for drone in campaign.drones):
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
            if drone.halted:
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
        if not is_allowed(campaign.state, trigger):
            raise Refused(f"a campaign that is {campaign.state} cannot {trigger}")
        self._move(trigger, reason, actor)

    def _move(self, trigger: Trigger, reason: str = "", actor: str = "system") -> None:
        """Record the transition, then make it."""
        campaign = self._need()
        state = next_state(campaign.state, trigger)
        severity = Severity.WARNING if trigger in {Trigger.FAIL, Trigger.LANDED_FAILED} else Severity.INFO
        words = f"{campaign.state} -> {state}" + (f": {reason}" if reason else "")
        self._event("campaign.state", words, severity, actor=actor, data={"state": str(state), "trigger": str(trigger)})
        campaign.state = state
        campaign.reason = reason or campaign.reason
        if trigger in ENDINGS:
            campaign.ending = ENDINGS[trigger]

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
