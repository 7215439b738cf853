"""One vehicle in a campaign: what it is doing, where it should be, and the orders under way."""

from dataclasses import dataclass, field
from enum import StrEnum

from gcs.mission.script import Script
from gcs.ports import (
    CommandKind,
    CommandTicket,
    FleetLink,
    FlightMode,
    UavTrack,
    VehicleCommand,
    VehicleStatus,
    Verdict,
)


class Control(StrEnum):
    """Who flies it."""

    AUTOPILOT = "autopilot"  # on the ground, taking off or landing by itself
    STREAM = "stream"  # our velocities are sent, not yet obeyed
    GUIDED = "guided"  # our velocities are obeyed; leaving the mode means that a person took over
    RELEASED = "released"  # not ours any more


@dataclass
class Goal:
    """A point to fly to and stay at."""

    point_m: tuple[float, float]
    alt_home_m: float
    speed_mps: float


@dataclass
class Drone:
    """Mutable record of one UAV; only the mission manager's thread touches it."""

    index: int
    system_id: int
    layer_alt_m: float
    launch_m: tuple[float, float]
    status: VehicleStatus | None = None
    track: UavTrack | None = None
    pad_m: tuple[float, float] | None = None
    control: Control = Control.AUTOPILOT
    goal: Goal | None = None
    script: Script = field(default_factory=lambda: Script(()))
    active: bool = False  # takes part in the slots
    landed: bool = False
    halted: bool = False  # stopped by the emergency stop, to be regained
    reason: str = ""  # why it was released or sent home
    ticket: CommandTicket | None = None
    attempts: int = 0
    retry_at_s: float = 0.0
    ordered_mode: FlightMode | None = None  # ours to fly by itself: seen before the ACK on a bad link

    @property
    def is_streamed(self) -> bool:
        """Velocities go to it."""
        return self.control in {Control.STREAM, Control.GUIDED}

    @property
    def is_airborne(self) -> bool:
        """In the air as far as we know, by its own altitude."""
        return self.track is not None and self.status is not None and self.status.armed and self.track.alt_home_m > 1.0

    def order(
        self, kind: CommandKind, link: FleetLink, now_s: float, *, attempts: int = 3, pause_s: float = 3.0
    ) -> Verdict | None:
        """Send an order and, when it is refused, again after a pause. The final verdict, or None meanwhile."""
        if self.ticket is None:
            if now_s < self.retry_at_s:
                return None
            altitude_m = self.layer_alt_m if kind is CommandKind.TAKEOFF else None
            self.ticket = link.submit(VehicleCommand(kind, self.system_id, altitude_m), now_s)
            self.attempts += 1
        verdict = self.ticket.verdict
        if verdict is None:
            return None
        self.ticket = None
        if verdict.accepted or self.attempts >= attempts:
            self.attempts = 0
            return verdict
        self.retry_at_s = now_s + pause_s
        return None

    def forget_orders(self) -> None:
        """A new script begins with no order under way."""
        self.ticket, self.attempts, self.retry_at_s = None, 0, 0.0
