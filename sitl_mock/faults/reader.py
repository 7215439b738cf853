"""Fault scripts: a TOML file of [[fault]] tables, or the same keys as JSON over the control port.

[[fault]]
kind = "loss"          # see kinds.py
vehicle = 2            # 0 or left out: every vehicle
at_s = 30.0            # simulated seconds after boot
for_s = 10.0           # left out: to the end
value = 0.3            # where the kind takes a number
direction = "up"       # link faults: up (to the vehicle), down, both (default)
"""

from __future__ import annotations

import tomllib
from dataclasses import fields
from math import isfinite
from typing import TYPE_CHECKING, Any

from sitl_mock.faults.fault import Fault, FaultError
from sitl_mock.faults.kinds import KINDS

if TYPE_CHECKING:
    from pathlib import Path

_NUMBERS = {"at_s", "for_s", "value"}
_TEXTS = {"kind", "direction", "text"}
_KEYS = [part.name for part in fields(Fault)]


class FaultFileError(FaultError):
    """The file says something that cannot be done; the message says where and how to mend it."""


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
    faults = []
    for number, row in enumerate(rows, start=1):
        try:
            faults.append(parse(row, vehicles=vehicles, modes=modes))
        except FaultError as error:
            raise FaultFileError(f"{path}: fault {number}: {error}") from error
    return faults


def _check_types(row: Any) -> None:
    if not isinstance(row, dict):
        raise FaultError("is no table; write [[fault]]")
    unknown = [key for key in row if key not in _KEYS]
    if unknown:
        raise FaultError(f"unknown key {unknown[0]!r}; known are {', '.join(_KEYS)}")
    for key, value in row.items():
        number = isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
        if key in _NUMBERS and not (number and (key == "value" or value >= 0)):
            raise FaultError(f"{key} = {value!r} is no number{'' if key == 'value' else ' of at least 0'}")
        if key in _TEXTS and not isinstance(value, str):
            raise FaultError(f"{key} = {value!r} is no text")


def parse(row: Any, *, vehicles: int, modes: tuple[str, ...]) -> Fault:
    """The fault that a table describes. Raises FaultError, one line."""
    _check_types(row)
    kind = KINDS.get(row.get("kind", ""))
    if kind is None:
        raise FaultError(f"kind = {row.get('kind')!r} is unknown; known are {', '.join(KINDS)}")
    vehicle = row.get("vehicle", 0)
    if type(vehicle) is not int or not 0 <= vehicle <= vehicles:
        raise FaultError(f"vehicle = {vehicle!r} is none of 0 (all) to {vehicles}")
    fault = Fault(**({"value": kind.default} | row))
    if fault.for_s <= 0:
        raise FaultError(f"for_s = {fault.for_s} is over before it begins; leave it out for no end")
    if fault.direction not in {"up", "down", "both"}:
        raise FaultError(f"direction = {fault.direction!r} is none of up, down, both")
    if kind.low is not None and not kind.low <= fault.value <= kind.high:
        raise FaultError(f"value = {fault.value} is not within {kind.low:g} to {kind.high:g}")
    if kind.whole and fault.value != int(fault.value):
        raise FaultError(f"value = {fault.value} counts things; give a whole number")
    if kind.needs_mode and fault.text not in modes:
        raise FaultError(f"text = {fault.text!r} is not a mode name; known are {', '.join(modes)}")
    return fault
