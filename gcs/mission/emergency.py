"""The emergency stop: every drone in the air is told to hold, again and again until it says yes. Latched."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from gcs.ports import CommandKind, CommandTicket, FleetLink, VehicleCommand, VehicleStatus, Verdict

REPEAT_S = 1.0


@dataclass
class EmergencyStop:
    """``latched`` until a person resets it; motors stay on (docs/safety.md says why)."""

    latched: bool = False
    _tickets: dict[int, CommandTicket] = field(default_factory=dict)
    _again_s: dict[int, float] = field(default_factory=dict)
    _obeyed: set[int] = field(default_factory=set)

    def press(self) -> None:
        """Stop everyone, again if pressed again."""
        self.latched = True
        self._obeyed.clear()
        self._again_s.clear()

    def reset(self) -> None:
        """A person takes responsibility for going on."""
        self.latched = False
        self._tickets.clear()
        self._obeyed.clear()
        self._again_s.clear()

    def step(self, vehicles: Mapping[int, VehicleStatus], link: FleetLink, now_s: float) -> list[Verdict]:
        """Send what is due; returns new verdicts for the log."""
        if not self.latched:
            return []
        verdicts = []
        for system_id, status in vehicles.items():
            if not status.armed or system_id in self._obeyed:
                continue
            verdict = self._press_one(system_id, link, now_s)
            if verdict is not None:
                verdicts.append(verdict)
        return verdicts

    def _press_one(self, system_id: int, link: FleetLink, now_s: float) -> Verdict | None:
        ticket = self._tickets.get(system_id)
        if ticket is None:
            if now_s >= self._again_s.get(system_id, now_s):
                self._tickets[system_id] = link.submit(VehicleCommand(CommandKind.HOLD, system_id), now_s)
            return None
        verdict = ticket.verdict
        if verdict is None:
            return None
        del self._tickets[system_id]
        if verdict.accepted:
            self._obeyed.add(system_id)
        else:
            self._again_s[system_id] = now_s + REPEAT_S
        return verdict
