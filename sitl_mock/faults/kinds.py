"""The kinds of faults: how each adds to what is broken, and what its value may be.

Faults of one kind that overlap add up (chances combine, delays and errors sum), so the end of one leaves the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from sitl_mock.faults.fault import Effects, Fault
from sitl_mock.link import Quality

Add = Callable[[Effects, Fault], None]


@dataclass(frozen=True, slots=True)
class Kind:
    """`add` is what it does as long as it lasts; one without (battery_drop, reboot) strikes once, at its start."""

    add: Add | None
    low: float | None = None  # None: takes no value
    high: float = inf
    default: float = 0.0  # value where none is given
    needs_mode: bool = False  # `text` must name a mode of the flavour
    whole: bool = False  # value counts things


def _either(first: float, second: float) -> float:
    """Chance that one of two independent things happens."""
    return 1.0 - (1.0 - first) * (1.0 - second)


def _chance(name: str) -> Kind:
    def add(effects: Effects, fault: Fault) -> None:
        for link in effects.links(fault.direction):
            setattr(link, name, _either(getattr(link, name), fault.value))

    return Kind(add, low=0.0, high=1.0)


def _time(name: str) -> Kind:
    def add(effects: Effects, fault: Fault) -> None:
        for link in effects.links(fault.direction):
            setattr(link, name, getattr(link, name) + fault.value)

    return Kind(add, low=0.0, high=600.0)


def _cut(effects: Effects, fault: Fault) -> None:
    def cut(link: Quality) -> None:
        link.cut = True

    for link in effects.links(fault.direction):
        cut(link)


def _deny(effects: Effects, fault: Fault) -> None:
    effects.arming_denied = fault.text or "PreArm: Check mag field"


def _lose_gps(effects: Effects, _: Fault) -> None:
    effects.gps_lost = True


def _pilot(effects: Effects, fault: Fault) -> None:
    effects.pilot_mode = fault.text


def _sum(name: str, *, low: float, high: float, default: float, whole: bool = False) -> Kind:
    def add(effects: Effects, fault: Fault) -> None:
        now = getattr(effects, name)
        setattr(effects, name, now + (int(fault.value) if whole else fault.value))

    return Kind(add, low, high, default, whole=whole)


KINDS: dict[str, Kind] = {
    "loss": _chance("loss"),
    "burst_loss": _chance("burst_loss"),
    "duplicate": _chance("duplicate"),
    "reorder": _chance("reorder"),
    "corrupt": _chance("corrupt"),
    "delay": _time("delay_s"),
    "jitter": _time("jitter_s"),
    "cut": Kind(_cut),
    "deny_arming": Kind(_deny),
    "gps_loss": Kind(_lose_gps),
    "gps_glitch": _sum("gps_offset_m", low=-1e5, high=1e5, default=50.0),
    "gps_noise": _sum("gps_noise_m", low=0.0, high=100.0, default=1.0),
    "compass_error": _sum("compass_error_deg", low=-180.0, high=180.0, default=30.0),
    "motor_out": _sum("motors_out", low=1.0, high=6.0, default=1.0, whole=True),
    "cell_failure": _sum("cells_failed", low=1.0, high=12.0, default=1.0, whole=True),
    "clock_drift": _sum("clock_rate", low=-0.5, high=0.5, default=0.001),
    "pilot": Kind(_pilot, needs_mode=True),
    "battery_drop": Kind(None, low=0.0, high=1.0),
    "reboot": Kind(None),
}
