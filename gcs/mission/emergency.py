"""The emergency stop, for all or for one: told to hold over every link, again and again until it says yes. Latched."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from gcs.ports import CommandKind, CommandTicket, FleetLink, FlightMode, VehicleCommand, VehicleStatus, Verdict

REPEAT_S = 1.0
DISOBEYED_S = 3.0  # a yes that its heartbeats do not show by now was worth nothing


@dataclass
class EmergencyStop:
    """``latched`` (for all) and ``ones`` until a person resets them; motors stay on (docs/safety.md says why)."""

    latched: bool = False
    ones: set[int] = field(default_factory=set)
    _tickets: dict[int, CommandTicket] = field(default_factory=dict)
    _again_s: dict[int, float] = field(default_factory=dict)
    _obeyed_s: dict[int, float] = field(default_factory=dict)

    def stops(self, system_id: int) -> bool:
        """This drone is to hold."""
        return self.latched or system_id in self.ones

    def press(self, system_id: int | None = None) -> None:
        """Stop everyone, or one; pressed again it is told again."""
        if system_id is None:
            self.latched = True
            self._again_s.clear()
            self._obeyed_s.clear()
        else:
            self.ones.add(system_id)
            self._again_s.pop(system_id, None)
            self._obeyed_s.pop(system_id, None)

    def reset(self, system_id: int | None = None) -> None:
        """A person takes responsibility for going on: for everyone, or for one."""
        if system_id is None:
            self.latched = False
            self.ones.clear()
        else:
            self.ones.discard(system_id)
        for memory in (self._tickets, self._again_s, self._obeyed_s):
            for known in [known for known in memory if not self.stops(known)]:
                del memory[known]

    def leave(self, system_id: int, now_s: float) -> None:
        """A person orders this vehicle something else meanwhile (to return, to land): the stop no longer presses it.

        The latch stays, and a vehicle that is seen in our own mode after that is told to hold again.
        """
        self._tickets.pop(system_id, None)
        self._again_s.pop(system_id, None)
        if self.stops(system_id):
            self._obeyed_s[system_id] = now_s

    def step(self, vehicles: Mapping[int, VehicleStatus], link: FleetLink, now_s: float) -> list[Verdict]:
        """Send what is due; returns new verdicts for the log."""
        verdicts = []
        for system_id, status in vehicles.items():
            if not status.armed or not self.stops(system_id) or self._obeys(system_id, status, now_s):
                continue
            verdict = self._press_one(system_id, link, now_s)
            if verdict is not None:
                verdicts.append(verdict)
        return verdicts

    def _obeys(self, system_id: int, status: VehicleStatus, now_s: float) -> bool:
        said_s = self._obeyed_s.get(system_id)
        if said_s is None:
            return False
        if status.mode is not FlightMode.GUIDED or now_s - said_s <= DISOBEYED_S:
            return True
        del self._obeyed_s[system_id]
        return False

    def _press_one(self, system_id: int, link: FleetLink, now_s: float) -> Verdict | None:
        ticket = self._tickets.get(system_id)
        if ticket is None:
            if now_s >= self._again_s.get(system_id, now_s):
                command = VehicleCommand(CommandKind.HOLD, system_id, urgent=True)
                self._tickets[system_id] = link.submit(command, now_s)
            return None
        verdict = ticket.verdict
        if verdict is None:
            return None
        del self._tickets[system_id]
        if verdict.accepted:
            self._obeyed_s[system_id] = now_s
        else:
            self._again_s[system_id] = now_s + REPEAT_S
        return verdict
