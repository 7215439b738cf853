"""What a campaign tells the journal: events in the operator's words, slots, checkpoints. Decides nothing."""

import math
from collections.abc import Mapping
from dataclasses import replace

from gcs.mission.campaign import Campaign
from gcs.ports import Checkpoint, DecisionRecord, Event, Journal, Severity, SlotRecord, Verdict
from gcs.safety.gate import GateAction, SealedSetpoint

GATE_QUIET_S = 5.0  # the gate has let a drone alone for so long: its next act is a new event


class CampaignLog:
    """One a manager; ``now_s`` and ``campaign`` are set by it."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._kept: Checkpoint | None = None
        self.now_s = 0.0
        self.campaign: Campaign | None = None

    def event(
        self,
        kind: str,
        message: str,
        severity: Severity = Severity.INFO,
        system_id: int | None = None,
        *,
        actor: str = "system",
        data: Mapping[str, object] | None = None,
    ) -> None:
        """Record one event of the campaign being flown, or of none."""
        campaign_id = self.campaign.order.campaign_id if self.campaign is not None else None
        self._journal.record(Event(self.now_s, kind, message, severity, campaign_id, system_id, actor, data or {}))

    def verdict(self, verdict: Verdict) -> None:
        """A vehicle's answer to a script's order."""
        command = verdict.command
        words = f": {verdict.reason}" if verdict.reason else ""
        data = {"command": str(command.kind), "result": str(verdict.result), "attempts": verdict.attempts}
        message = f"drone {command.system_id} {command.kind}: {verdict.result}{words}"
        self.event("command.verdict", message, system_id=command.system_id, data=data | {"reason": verdict.reason})

    def gate(self, campaign: Campaign, safe: SealedSetpoint) -> None:
        """One event when the gate begins to act on a drone, none while it goes on with short breaks."""
        if safe.action is GateAction.PASSED or "limit" in safe.reason:
            return
        system_id = safe.setpoint.system_id
        reason, last_s = campaign.gate_acts.get(system_id, ("", -math.inf))
        if reason != safe.reason or self.now_s - last_s > GATE_QUIET_S:
            kind = f"gate.{safe.action}"
            self.event(kind, f"drone {system_id} {safe.action} by the gate: {safe.reason}", system_id=system_id)
        campaign.gate_acts[system_id] = (safe.reason, self.now_s)

    def slot(self, campaign: Campaign, record: SlotRecord) -> None:
        """Keep a closed slot. Nothing is waited for: it is told when it is in the store, and one that a killed server
        had not written is closed anew by the next one.
        """
        campaign.records.append(record)
        self._journal.record_slot(campaign.order.campaign_id, record)
        self.setpoints(campaign, record.slot)
        self.keep(campaign)

    def decision(self, campaign: Campaign, decided: DecisionRecord) -> None:
        """What the policy was asked and what it answered."""
        self._journal.record_decision(campaign.order.campaign_id, decided)

    def setpoints(self, campaign: Campaign, slot: int) -> None:
        """What each drone was told since the last slot that was closed."""
        told = campaign.setpoints.close()
        if told:
            self._journal.record_setpoints(campaign.order.campaign_id, slot, told)

    def violations(self, campaign: Campaign, record: SlotRecord) -> None:
        """What the slot broke, counted from where the vehicles really were."""
        battery_j = campaign.scenario.battery_j
        added = campaign.monitor.end_slot([u.system_id for u in record.uavs if u.active and u.energy_j >= battery_j])
        broken = ", ".join(f"{rule} {count}" for rule, count in added.items() if count)
        if broken:
            self.event("safety.violation", f"slot {record.slot}: {broken}", Severity.WARNING, data=dict(added))

    def keep(self, campaign: Campaign) -> None:
        """A checkpoint when something in it changed but the time."""
        now = campaign.checkpoint(self.now_s)
        if self._kept is None or replace(now, slot_elapsed_s=self._kept.slot_elapsed_s) != self._kept:
            self._kept = now
            self._journal.checkpoint(now)

    def settle(self) -> None:
        """Wait a moment for the store; a stalled one is told by the journal and never waited for."""
        self._journal.settle()
