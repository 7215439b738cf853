"""A fault, and the sum of all faults that a vehicle suffers at a time."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

from sitl_mock.link import Quality


class FaultError(ValueError):
    """A fault says something that cannot be done; the message says what and how to mend it."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One entry of the script."""

    kind: str
    vehicle: int = 0  # 0: every vehicle
    at_s: float = 0.0
    for_s: float = inf
    value: float = 0.0
    direction: str = "both"
    text: str = ""


@dataclass(slots=True)
class Effects:
    """What is broken at present, all faults taken together. Made anew whenever a fault begins or ends."""

    up: Quality = field(default_factory=Quality)
    down: Quality = field(default_factory=Quality)
    arming_denied: str | None = None
    gps_lost: bool = False
    gps_offset_m: float = 0.0  # how far north the receiver is wrong (glitch)
    gps_noise_m: float = 0.0  # standard deviation of the receiver's error
    compass_error_deg: float = 0.0
    motors_out: int = 0
    cells_failed: int = 0
    clock_rate: float = 0.0  # seconds that the clock gains a second
    pilot_mode: str | None = None  # the radio's mode switch wins over the ground station

    def links(self, direction: str) -> list[Quality]:
        """The directions meant."""
        return [link for name, link in (("up", self.up), ("down", self.down)) if direction in {name, "both"}]
