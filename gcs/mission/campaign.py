"""A campaign in flight: everything that lasts from its start to its end."""

import uuid
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gcs.mission.drone import Drone
from gcs.mission.order import CampaignOrder, fleet_limits, planning_scenario
from gcs.mission.resume import Resumption
from gcs.mission.setpoint_books import SetpointBooks
from gcs.mission.slot_flight import SlotFlight
from gcs.mission.states import Trigger
from gcs.ports import (
    CampaignSnapshot,
    CampaignState,
    Checkpoint,
    DecisionRecord,
    DroneCheckpoint,
    SlotRecord,
    UavTrack,
    VehicleStatus,
)
from gcs.safety.envelope import envelope_of
from gcs.safety.gate import SafetyGate
from gcs.safety.monitor import ViolationMonitor


class Campaign:
    """Everything about the campaign being flown; made at its start."""

    def __init__(
        self, order: CampaignOrder, vehicles: Mapping[int, VehicleStatus], resumption: Resumption | None = None
    ) -> None:
        """``resumption``: another server flew it before; it is pending until the drones are in our hands again."""
        self.order = order
        self.resumption = resumption
        known = [vehicles[i].limits for i in order.system_ids if i in vehicles]
        self.limits = resumption.limits if resumption is not None else fleet_limits(order.scenario, known)
        self.scenario = planning_scenario(order.scenario, self.limits, order.settings)
        self.envelope = envelope_of(self.scenario, self.limits.max_accel_mps2, self.limits.setpoint_timeout_s)
        self.gate = SafetyGate(self.envelope)
        self.monitor = ViolationMonitor(self.envelope)
        self.drones = tuple(_make_drone(order, index) for index in range(len(order.system_ids)))
        self.state = CampaignState.READY
        self.ending = Trigger.LANDED
        self.reason = ""
        self.settled_s: float | None = None  # since when a recovery has nothing left to do but to see who stands
        self.slots: SlotFlight | None = None
        self.records: list[SlotRecord] = []
        self.setpoints = SetpointBooks()
        self.session = uuid.uuid4().hex[:12]  # of the policy: begun at the start, and anew after a restart
        self.policy_seed = order.seed
        self.bystanders: list[UavTrack] = []  # own drones in the air that are none of the campaign's
        self.gate_acts: dict[int, tuple[str, float]] = {}  # system id -> newest reason, when
        if resumption is not None:
            was = resumption.checkpoint
            self.state, self.ending, self.reason = resumption.state, Trigger(was.ending), was.reason
            self.records = list(resumption.records)
            self.policy_seed += was.slot

    def signed(self, decided: DecisionRecord) -> DecisionRecord:
        """A decision with how its policy was begun."""
        return replace(
            decided,
            session=self.session,
            seed=self.policy_seed,
            max_speed_mps=self.scenario.max_speed_mps,
            max_accel_mps2=self.scenario.max_accel_mps2,
        )

    def checkpoint(self, now_s: float) -> Checkpoint:
        """What a restarted server must know to take this campaign up, beside the slot records."""
        slots = self.slots
        return Checkpoint(
            campaign_id=self.order.campaign_id,
            state=self.state,
            ending=self.ending.value,
            reason=self.reason,
            slot=0 if slots is None else slots.slot,
            slot_elapsed_s=0.0 if slots is None else slots.elapsed_s(now_s),
            max_speed_mps=self.limits.max_speed_mps,
            max_accel_mps2=self.limits.max_accel_mps2,
            seed=self.order.seed,
            drones=tuple(
                DroneCheckpoint(d.system_id, d.control.value, d.pad_m, d.active, d.landed) for d in self.drones
            ),
        )

    def snapshot(self, now_s: float) -> CampaignSnapshot:
        """As it stands, frozen."""
        order, slots = self.order, self.slots
        head: dict[str, Any] = {
            "campaign_id": order.campaign_id,
            "name": order.name,
            "policy": order.policy,
            "state": self.state,
            "slots": order.scenario.slots,
            "slot_s": order.scenario.slot_s,
            "reason": self.reason,
        }
        if slots is None:
            latest = self.records[-1] if self.records else None  # being taken up after a restart
            slot, metrics = (0, None) if latest is None else (latest.slot, latest.metrics)
            return CampaignSnapshot(**head, slot=slot, slot_elapsed_s=0.0, metrics=metrics, latest=latest)
        return CampaignSnapshot(
            **head,
            slot=slots.slot,
            slot_elapsed_s=0.0 if slots.finished else slots.elapsed_s(now_s),
            metrics=slots.metrics,
            plans=slots.plans(),
            latest=slots.latest,
            decision_ms=slots.decision_ms,
            explanation=slots.decision.explanation if slots.decision is not None else {},
        )


def _make_drone(order: CampaignOrder, index: int) -> Drone:
    scenario = order.scenario
    layer_alt_m = scenario.altitude_m - scenario.layer_m * index
    launch_m = (float(scenario.launch_enu_m[index, 0]), float(scenario.launch_enu_m[index, 1]))
    return Drone(index, order.system_ids[index], layer_alt_m, launch_m)
