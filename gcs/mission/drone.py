"""One vehicle in a campaign: what it is doing, where it should be, and the orders under way."""

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

from gcs.mission.script import Script
from gcs.ports import CommandKind, CommandTicket, FlightMode, UavTrack, VehicleCommand, VehicleStatus, Verdict


class Control(StrEnum):
    """Who flies it."""

    AUTOPILOT = "autopilot"  # on the ground, taking off or landing by itself
    STREAM = "stream"  # our velocities are sent, not yet obeyed
    GUIDED = "guided"  # our velocities are obeyed; leaving the mode means that a person took over
    RELEASED = "released"  # not ours any more


class OrderTaker(Protocol):
    """Where orders go: the part of a ports.FleetLink that scripts may use."""

    def submit(self, command: VehicleCommand, now_s: float) -> CommandTicket: ...


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
    halted: bool = False  # takes no part in the slots until it has been taken over again
    stopped: bool = False  # by the emergency stop for this one; was in the slots where ``rejoins``
    rejoins: bool = False
    parked_in: str = ""  # the mode that it was in when it began to be taken over
    doubted: bool = False  # it does not trust its own position
    top_mps: float = math.inf  # less after a failure
    waits_for: int | None = None  # the drone that has long been below it, over its pad
    low_told: bool = False  # its battery was told of: nobody brings it home by itself
    silent_s: float | None = None  # since when nothing is heard of it
    gap_s: float = -math.inf  # when its link, one way or the other, was last seen to be dead
    excused_s: float = -math.inf  # silences until then have accounted for a change of mode
    ours_s: float = -math.inf  # the newest heartbeat in a mode that our orders lead to
    reason: str = ""  # why it was released or sent home
    ticket: CommandTicket | None = None
    ordering: CommandKind | None = None  # the order under way
    launch_ordered: bool = False  # to arm or to take off: it may be on its way up though nothing shows it yet
    attempts: int = 0
    retry_at_s: float = 0.0
    verdicts: list[Verdict] = field(default_factory=list)  # answers that the log has not told yet

    @property
    def is_streamed(self) -> bool:
        """Velocities go to it."""
        return self.control in {Control.STREAM, Control.GUIDED}

    @property
    def is_airborne(self) -> bool:
        """In the air as far as we know, by its own altitude."""
        return self.track is not None and self.status is not None and self.status.armed and self.track.alt_home_m > 1.0

    @property
    def spends_energy(self) -> bool:
        """In the air, or not heard since a restart that left it there: the books count on hovering."""
        return self.is_airborne or (self.silent_s is not None and self.track is None)

    def order(
        self, kind: CommandKind, link: OrderTaker, now_s: float, *, attempts: int = 3, pause_s: float = 3.0
    ) -> Verdict | None:
        """Send an order and, when it is refused, again after a pause. The final verdict, or None meanwhile."""
        if self.ticket is None:
            if now_s < self.retry_at_s:
                return None
            altitude_m = self.layer_alt_m if kind is CommandKind.TAKEOFF else None
            self.ticket = link.submit(VehicleCommand(kind, self.system_id, altitude_m), now_s)
            self.attempts, self.ordering = self.attempts + 1, kind
            self.launch_ordered = self.launch_ordered or kind in {CommandKind.ARM, CommandKind.TAKEOFF}
        verdict = self.ticket.verdict
        if verdict is None:
            return None
        self.ticket = self.ordering = None
        self.verdicts.append(verdict)
        self.retry_at_s = now_s + pause_s  # also after a yes: it shows in a heartbeat only, once a second
        if verdict.accepted or self.attempts >= attempts:
            self.attempts = 0
            return verdict
        return None

    @property
    def obeys_already(self) -> bool:
        """Its mode shows the landing or return that we ordered, before the answer was heard."""
        ordered = self.ordering in {CommandKind.LAND, CommandKind.RETURN}
        return ordered and self.status is not None and self.status.mode in {FlightMode.LAND, FlightMode.RETURN}

    def park(self) -> None:
        """Remember the mode in which it waits to be taken over: any other one is then a person's."""
        self.parked_in = self.status.mode_name if self.status is not None else ""

    def take_verdicts(self) -> list[Verdict]:
        """What the vehicle answered since the last call."""
        verdicts, self.verdicts = self.verdicts, []
        return verdicts

    def forget_orders(self) -> None:
        """A new script begins with no order under way."""
        self.ticket, self.ordering, self.attempts, self.retry_at_s = None, None, 0, 0.0
