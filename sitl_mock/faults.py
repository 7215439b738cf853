"""Fault scripts: a TOML file that says what breaks, when, for how long and on which vehicle.

[[fault]]
kind = "loss"          # see KINDS
vehicle = 2            # 0 or left out: every vehicle
at_s = 30.0            # simulated seconds after boot
for_s = 10.0           # left out: to the end
value = 0.3            # where the kind takes a number
direction = "up"       # link faults: up (to the vehicle), down, both (default)
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from sitl_mock.autopilot import Autopilot
    from sitl_mock.link import Link


class FaultFileError(ValueError):
    """The file says something that cannot be done; the message says where and how to mend it."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One line of the script."""

    kind: str
    vehicle: int = 0
    at_s: float = 0.0
    for_s: float = inf
    value: float = 0.0
    direction: str = "both"
    text: str = ""


@dataclass(frozen=True, slots=True)
class Victim:
    """What a fault can reach of one vehicle."""

    autopilot: Autopilot
    up: Link
    down: Link

    def links(self, direction: str) -> list[Link]:
        """The directions meant."""
        return [link for name, link in (("up", self.up), ("down", self.down)) if direction in {name, "both"}]


@dataclass(frozen=True, slots=True)
class Kind:
    """How a fault begins and ends, and what its value may be."""

    begin: Callable[[Victim, Fault], None]
    end: Callable[[Victim, Fault], None]
    low: float | None = None  # None: takes no value
    high: float = inf
    needs_text: str = ""  # what `text` must hold, empty if it may be left out


def _link(field: str, *, low: float = 0.0, high: float = inf) -> Kind:
    def put(victim: Victim, fault: Fault, value: float) -> None:
        for link in victim.links(fault.direction):
            setattr(link.quality, field, value)

    return Kind(lambda v, f: put(v, f, f.value), lambda v, f: put(v, f, 0.0), low, high)


def _cut(victim: Victim, fault: Fault, *, cut: bool) -> None:
    for link in victim.links(fault.direction):
        link.quality.cut = cut


def _deny(victim: Victim, reason: str | None) -> None:
    victim.autopilot.faults.arming_denied = reason


def _gps(victim: Victim, *, lost: bool) -> None:
    victim.autopilot.faults.gps_lost = lost


def _pilot_leaves(victim: Victim, _: Fault) -> None:
    victim.autopilot.faults.pilot_holds = False


KINDS: dict[str, Kind] = {
    "loss": _link("loss", high=1.0),
    "delay": _link("delay_s"),
    "jitter": _link("jitter_s"),
    "duplicate": _link("duplicate", high=1.0),
    "cut": Kind(lambda v, f: _cut(v, f, cut=True), lambda v, f: _cut(v, f, cut=False)),
    "deny_arming": Kind(lambda v, f: _deny(v, f.text or "PreArm: Check mag field"), lambda v, _: _deny(v, None)),
    "gps_loss": Kind(lambda v, _: _gps(v, lost=True), lambda v, _: _gps(v, lost=False)),
    "pilot": Kind(lambda v, f: v.autopilot.switch_by_radio(f.text), _pilot_leaves, needs_text="a mode name"),
    "battery_drop": Kind(lambda v, f: v.autopilot.vehicle.body.drain(f.value), lambda _v, _f: None, low=0.0, high=1.0),
}
_NUMBERS = {"at_s", "for_s", "value"}
_KEYS = [part.name for part in fields(Fault)]


def load(path: Path, *, vehicles: int, modes: tuple[str, ...]) -> list[Fault]:
    """Reads and checks a fault file. Raises FaultFileError, one line."""
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FaultFileError(f"{path}: cannot be read ({error.strerror}); name a TOML file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FaultFileError(f"{path}: is no TOML: {error}") from error
    rows = document.pop("fault", [])
    if document or not isinstance(rows, list):
        unknown = ", ".join(document) or "fault"
        raise FaultFileError(f"{path}: unknown key {unknown}; faults are [[fault]] tables")
    return [_fault(row, f"{path}: fault {n}", vehicles, modes) for n, row in enumerate(rows, start=1)]


def _fault(row: Any, where: str, vehicles: int, modes: tuple[str, ...]) -> Fault:
    if not isinstance(row, dict):
        raise FaultFileError(f"{where}: is no table; write [[fault]]")
    unknown = [key for key in row if key not in _KEYS]
    if unknown:
        raise FaultFileError(f"{where}: unknown key {unknown[0]!r}; known are {', '.join(_KEYS)}")
    for key, value in row.items():
        number = isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
        if key in _NUMBERS and not (number and value >= 0):
            raise FaultFileError(f"{where}: {key} = {value!r} is no number of at least 0")
        if key in {"kind", "direction", "text"} and not isinstance(value, str):
            raise FaultFileError(f"{where}: {key} = {value!r} is no text")
    kind = KINDS.get(row.get("kind", ""))
    if kind is None:
        raise FaultFileError(f"{where}: kind = {row.get('kind')!r} is unknown; known are {', '.join(KINDS)}")
    vehicle = row.get("vehicle", 0)
    if type(vehicle) is not int or not 0 <= vehicle <= vehicles:
        raise FaultFileError(f"{where}: vehicle = {vehicle!r} is none of 0 (all) to {vehicles}")
    fault = Fault(**row)
    if fault.for_s <= 0:
        raise FaultFileError(f"{where}: for_s = {fault.for_s} is over before it begins; leave it out for no end")
    if fault.direction not in {"up", "down", "both"}:
        raise FaultFileError(f"{where}: direction = {fault.direction!r} is none of up, down, both")
    if kind.low is not None and not kind.low <= fault.value <= kind.high:
        raise FaultFileError(f"{where}: value = {fault.value} is not within {kind.low} to {kind.high}")
    if kind.needs_text and fault.text not in modes:
        raise FaultFileError(f"{where}: text = {fault.text!r} is not {kind.needs_text}; known are {', '.join(modes)}")
    return fault


class Script:
    """Starts and ends the faults of a run as time passes."""

    def __init__(self, faults: list[Fault]) -> None:
        """`faults` in any order."""
        starts = [(fault.at_s, 1, n, fault) for n, fault in enumerate(faults)]
        ends = [(fault.at_s + fault.for_s, 0, n, fault) for n, fault in enumerate(faults) if isfinite(fault.for_s)]
        self._events = sorted(starts + ends, key=lambda event: event[:3])
        self._next = 0

    def advance(self, now_s: float, victims: list[Victim]) -> None:
        """Carries out what is due by now."""
        while self._next < len(self._events) and self._events[self._next][0] <= now_s + 1e-9:
            _, begins, _, fault = self._events[self._next]
            self._next += 1
            kind = KINDS[fault.kind]
            act = kind.begin if begins else kind.end
            for victim in victims if fault.vehicle == 0 else [victims[fault.vehicle - 1]]:
                act(victim, fault)
