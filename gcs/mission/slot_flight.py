"""The slots of a campaign: ask for a decision, fly it with the loop closed, keep the books, slot after slot.

Pausing stops the slot clock: neither AoI nor data grow while the fleet holds, only energy is spent.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gcs.fleet.energy_meter import EnergyMeter
from gcs.fleet.ledger import CampaignLedger, FleetState
from gcs.guidance.reference import SlotReference, slot_references
from gcs.guidance.tracking import approach, follow, holding_point_m, keep_velocity
from gcs.mission.drone import Drone, Goal
from gcs.mission.order import CampaignOrder
from gcs.ports import (
    DecisionRecord,
    LivePlaces,
    PlanFailure,
    PlanTicket,
    SlotRecord,
    UavPlan,
    UavTrack,
    VelocitySetpoint,
)
from policy.agents.base import Decision
from policy.world.arrays import Array, FloatArray
from policy.world.metrics import Metrics
from policy.world.scenario import Scenario
from policy.world.state import WorldState

TIME_TOLERANCE_S = 1e-6
SPEED_TOLERANCE = 1e-6  # rounding of a policy that commands the limit itself
SHORTEST_PLAN_S = 3.0  # with less of a slot left, a fleet that was just regained holds until the next one


@dataclass(frozen=True)
class SlotTrouble:
    """A slot without a usable decision: the fleet holds, the next slot tries again."""

    kind: str  # plan.late | plan.failed | plan.rejected
    reason: str


@dataclass(frozen=True)
class FlownBefore:
    """What another server recorded of these slots; ``start_s`` of the slot then flown, on our flight clock."""

    records: tuple[SlotRecord, ...]
    start_s: float
    paused: bool


class SlotFlight:
    """From the first slot's start to the last one's end."""

    def __init__(
        self,
        order: CampaignOrder,
        scenario: Scenario,
        drones: Sequence[Drone],
        now_s: float,
        *,
        virtual: bool,
        before: FlownBefore | None = None,
    ) -> None:
        """``scenario`` as these vehicles fly it; ``virtual``: time stands still while a decision is awaited."""
        self._order, self.scenario, self._drones = order, scenario, drones
        self._settings = order.settings
        self._virtual = virtual
        self._last_place_m = np.array([drone.launch_m for drone in drones])
        self._energy_j: FloatArray = np.zeros(len(drones))
        if before is not None:
            self._energy_j = np.array([uav.energy_j for uav in before.records[-1].uavs])
        self._meter = EnergyMeter(len(drones), self._energy_j)
        self._ledger = CampaignLedger(
            order.scenario, order.places, order.user_ids, order.system_ids, self._fleet_state()
        )
        self.decision: Decision | None = None
        self.decision_ms: float | None = None
        self._asked: WorldState | None = None
        self._ticket: PlanTicket | None = None
        self._late: deque[tuple[WorldState, PlanTicket]] = deque()
        self._decided: list[DecisionRecord] = []
        self._references: tuple[SlotReference, ...] | None = None
        self._plans: tuple[UavPlan, ...] = ()
        self._paused_at_s: float | None = None
        self._plan_wanted = False  # the slot was taken up in its middle: to be planned when the fleet obeys
        self._slot_start_s = now_s
        if before is None:
            self.latest: SlotRecord = self._ledger.record(now_s, self._fleet_state(), None)
            self._begin_slot(now_s)
        else:
            self._take_up(before, now_s)

    @property
    def slot(self) -> int:
        """The slot being flown, from 0; T when all are done."""
        return self._ledger.slots_closed

    @property
    def finished(self) -> bool:
        """All slots are in the books."""
        return self.slot >= self.scenario.slots

    @property
    def metrics(self) -> Metrics | None:
        """So far."""
        return self.latest.metrics

    def elapsed_s(self, now_s: float) -> float:
        """Time on the slot clock."""
        return (self._paused_at_s if self._paused_at_s is not None else now_s) - self._slot_start_s

    def plans(self) -> tuple[UavPlan, ...]:
        """What the active UAVs do in this slot, for the map; none while holding."""
        if self._references is None:
            return ()
        return tuple(plan for drone, plan in zip(self._drones, self._plans, strict=True) if drone.active)

    def take_decided(self) -> tuple[DecisionRecord, ...]:
        """What the policy has decided since the last call, in its order: flown, or too late to be flown."""
        decided, self._decided = self._decided, []
        return tuple(decided)

    def _note(
        self, asked: WorldState, decision: Decision, duration_ms: float | None, now_s: float, *, flown: bool
    ) -> None:
        live = isinstance(self._order.places, LivePlaces)
        record = DecisionRecord(
            slot=asked.slot,
            pos_enu_m=tuple((float(e), float(n)) for e, n in asked.uav_pos_enu_m),
            vel_enu_mps=tuple((float(e), float(n)) for e, n in asked.uav_vel_enu_mps),
            energy_left_j=tuple(map(float, asked.uav_energy_j)),
            active=tuple(map(bool, asked.uav_active)),
            heading_rad=tuple(map(float, decision.action.heading_rad)),
            speed_mps=tuple(map(float, decision.action.speed_mps)),
            end_heading_rad=_numbers(decision.action.end_heading_rad),
            end_speed_mps=_numbers(decision.action.end_speed_mps),
            duration_ms=duration_ms,
            flown=flown,
            users=_user_states(asked) if live else (),
            time_s=now_s,
            explanation=decision.explanation,  # worked out by who keeps it
        )
        self._decided.append(record)

    def _note_late(self, now_s: float) -> None:
        """An answer that came too late still moved the policy on: without it the next ones could not be made again."""
        while self._late and (answer := self._late[0][1].poll()) is not None:
            asked, ticket = self._late.popleft()
            if isinstance(answer, Decision) and self._fault(answer) is None:
                self._note(asked, answer, ticket.duration_ms, now_s, flown=False)

    def _fault(self, decision: Decision) -> str | None:
        return decision_fault(decision, len(self._drones), self.scenario.max_speed_mps)

    def measure(self, now_s: float) -> None:
        """Every tick, paused or not: energy and places as flown."""
        tracks = [drone.track for drone in self._drones]
        self._meter.tick(
            now_s,
            [track.speed_mps if track is not None else 0.0 for track in tracks],
            [drone.spends_energy for drone in self._drones],
        )

    def step(self, now_s: float) -> tuple[SlotRecord | None, SlotTrouble | None]:
        """One tick of the slot clock: the record of a slot that ended, and what kept a decision from being flown."""
        record = None
        self._note_late(now_s)
        if now_s >= self._slot_start_s + self.scenario.slot_s - TIME_TOLERANCE_S:
            record = self._end_slot(now_s)
            if self.finished:
                self._references = None
                return record, None
            self._begin_slot(self._slot_start_s + self.scenario.slot_s, now_s)
        elif self._plan_wanted and not any(drone.halted and drone.active for drone in self._drones):
            self._plan_rest(now_s)
        return record, self._take_decision(now_s)

    def catch_up(self, now_s: float) -> tuple[SlotRecord, ...]:
        """Close the slots that ended unwatched, with the fleet where it was found and users where they were then."""
        airborne = [drone.spends_energy for drone in self._drones]
        if self._paused_at_s is not None:
            return ()
        slot_s, missed = self.scenario.slot_s, []
        while not self.finished and now_s >= self._slot_start_s + slot_s - TIME_TOLERANCE_S:
            self._meter.assume_hover(slot_s, airborne)
            self._slot_start_s += slot_s
            missed.append(self._end_slot(self._slot_start_s))
        self._meter.assume_hover(max(0.0, now_s - self._slot_start_s), airborne)
        return tuple(missed)

    def pause(self, now_s: float) -> None:
        """Stop the slot clock; the fleet holds where it can come to rest.

        A decision under way is for where the fleet is now: what is left of the slot is planned anew afterwards.
        """
        self._paused_at_s = now_s
        if self._ticket is not None and self._asked is not None:
            self._late.append((self._asked, self._ticket))
            self._ticket, self._plan_wanted = None, True
        self.hold_all()

    def resume(self, now_s: float) -> None:
        """Go on with the slot where it was left."""
        assert self._paused_at_s is not None
        delay_s = now_s - self._paused_at_s
        self._paused_at_s = None
        self._slot_start_s += delay_s
        if self._references is not None:
            self._references = tuple(reference.delayed(delay_s) for reference in self._references)

    def hold_all(self) -> None:
        """New holding points for all that fly."""
        for drone in self._drones:
            if drone.track is not None:
                self._hold(drone, drone.track)

    def wish(self, drone: Drone, track: UavTrack, now_s: float) -> VelocitySetpoint:
        """What this drone should be told now."""
        gains, top_mps = self._settings.gains, self.scenario.max_speed_mps
        if self._paused_at_s is None and drone.active:
            if self._references is not None:
                return follow(
                    track, self._references[drone.index], drone.layer_alt_m, now_s, max_speed_mps=top_mps, gains=gains
                )
            if self._ticket is not None:  # within the grace: go on as before
                return keep_velocity(track, self._entry_mps[drone.index], drone.layer_alt_m, top_mps, gains)
        if drone.goal is None:
            self._hold(drone, track)
        assert drone.goal is not None
        return approach(track, drone.goal.point_m, drone.layer_alt_m, drone.goal.speed_mps, gains)

    def _hold(self, drone: Drone, track: UavTrack) -> None:
        point_m = holding_point_m(track, self.scenario.max_accel_mps2)
        drone.goal = Goal(point_m, drone.layer_alt_m, self._settings.transit_speed_mps)

    def _take_up(self, before: FlownBefore, now_s: float) -> None:
        self._ledger.reopen(before.records)
        self.latest = before.records[-1]
        self._slot_start_s = before.start_s
        self._paused_at_s = now_s if before.paused else None
        self._plan_wanted = True

    def _plan_rest(self, now_s: float) -> None:
        """The fleet obeys again in the middle of a slot: fly what is left of it, if that is worth a plan."""
        self._plan_wanted = False
        if self._slot_start_s + self.scenario.slot_s - now_s >= SHORTEST_PLAN_S:
            self._begin_slot(self._slot_start_s, now_s)

    def _begin_slot(self, start_s: float, now_s: float | None = None) -> None:
        """Missed ticks are not made up for: a slot that starts late starts from where the fleet is."""
        self._slot_start_s, self._plan_wanted = start_s, False
        self._plan_start_s = start_s if now_s is None else now_s
        self._references, self.decision = None, None  # the one before says nothing of this slot
        fleet = self._fleet_state()
        self._entry_m, self._entry_vel_mps = fleet.pos_enu_m, fleet.vel_enu_mps
        self._entry_mps = [(float(v[0]), float(v[1])) for v in fleet.vel_enu_mps]
        self._asked = self._ledger.state(fleet)
        self._ticket = self._order.planner.request(self._asked)
        if self._virtual:
            self._ticket.wait(self._settings.plan_wait_s)

    def _end_slot(self, now_s: float) -> SlotRecord:
        self._energy_j = self._meter.used_j()
        fleet = self._fleet_state()
        self._ledger.close_slot(fleet)
        self.latest = self._ledger.record(now_s, fleet, self.decision_ms)
        return self.latest

    def _take_decision(self, now_s: float) -> SlotTrouble | None:
        if self._ticket is None:
            return None
        answer = self._ticket.poll()
        if answer is None:
            if not self._virtual and now_s - self._plan_start_s <= self._settings.plan_grace_s:
                return None
            assert self._asked is not None
            self._late.append((self._asked, self._ticket))
            return self._give_up("plan.late", f"no decision {now_s - self._plan_start_s:.1f} s into the slot")
        if isinstance(answer, PlanFailure):
            return self._give_up("plan.failed", answer.reason)
        fault = self._fault(answer)
        if fault is not None:
            return self._give_up("plan.rejected", fault)
        self.decision, self.decision_ms = answer, self._ticket.duration_ms
        self._ticket = None
        assert self._asked is not None
        self._note(self._asked, answer, self.decision_ms, now_s, flown=True)
        self._references = slot_references(
            self._entry_m,
            self._entry_vel_mps,
            np.asarray(answer.action.vel_enu_mps, dtype=np.float64),
            max_accel_mps2=self.scenario.max_accel_mps2,
            slot_s=self._slot_start_s + self.scenario.slot_s - self._plan_start_s,
            start_s=self._plan_start_s,
            vel_end_mps=answer.action.end_vel_enu_mps,
        )
        heading, speed = answer.action.heading_rad, answer.action.speed_mps
        self._plans = tuple(
            UavPlan(drone.system_id, float(heading[i]), float(speed[i]), self._references[i].outline())
            for i, drone in enumerate(self._drones)
        )
        return None

    def _give_up(self, kind: str, reason: str) -> SlotTrouble:
        self._ticket, self.decision, self.decision_ms = None, None, None
        self.hold_all()
        return SlotTrouble(kind, reason)

    def _fleet_state(self) -> FleetState:
        """From the newest tracks; a drone that is silent stays where it was last seen."""
        velocities = np.zeros((len(self._drones), 2))
        for drone in self._drones:
            if drone.track is not None:
                self._last_place_m[drone.index] = (drone.track.east_m, drone.track.north_m)
                velocities[drone.index] = (drone.track.vel_east_mps, drone.track.vel_north_mps)
        active = [d.active and d.track is not None and not d.track.is_stale for d in self._drones]
        return FleetState(self._last_place_m.copy(), velocities, self._energy_j, np.array(active, dtype=np.bool_))


def _numbers(values: Array | None) -> tuple[float, ...] | None:
    return None if values is None else tuple(map(float, values))


def _user_states(state: WorldState) -> tuple[tuple[float, float, float, float, bool], ...]:
    """[M] as in DecisionRecord.users."""
    columns = zip(
        state.user_pos_enu_m.tolist(),
        state.user_data_mb.tolist(),
        state.user_aoi_slots.tolist(),
        state.user_active.tolist(),
        strict=True,
    )
    return tuple((pos[0], pos[1], data_mb, aoi, active) for pos, data_mb, aoi, active in columns)


def decision_fault(decision: Decision, num_uavs: int, max_speed_mps: float) -> str | None:
    """Why a decision cannot be flown, or None: shape, numbers, limits; of the velocities at the slot's end as well."""
    action = decision.action
    fault = _velocity_fault(action.heading_rad, action.speed_mps, num_uavs, max_speed_mps)
    if fault is not None or action.end_heading_rad is None:
        return fault
    fault = _velocity_fault(action.end_heading_rad, action.end_speed_mps, num_uavs, max_speed_mps)
    return None if fault is None else f"at the slot's end {fault}"


def _velocity_fault(headings_rad: Array, speeds_mps: Array, num_uavs: int, max_speed_mps: float) -> str | None:
    heading, speed = np.asarray(headings_rad), np.asarray(speeds_mps)
    if heading.shape != (num_uavs,) or speed.shape != (num_uavs,):
        return f"the decision has shapes {heading.shape} and {speed.shape}, not ({num_uavs},) twice"
    if heading.dtype.kind not in "fiu" or speed.dtype.kind not in "fiu":
        return f"the decision holds {heading.dtype} and {speed.dtype}, not numbers"
    if not (np.all(np.isfinite(heading)) and np.all(np.isfinite(speed))):
        return "the decision holds NaN or infinity"
    slowest, fastest = float(np.min(speed)), float(np.max(speed))
    if slowest < 0.0 or fastest > max_speed_mps * (1.0 + SPEED_TOLERANCE) + math.ulp(max_speed_mps):
        return f"the decision wants {slowest:g} to {fastest:g} m/s; allowed are 0 to {max_speed_mps:g}"
    return None
