"""Parameters: typed values by name and index, and the two ways in which integers travel in a float field."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum
from math import isfinite
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


class ParamType(IntEnum):
    """MAV_PARAM_TYPE."""

    INT8 = 2
    INT16 = 4
    INT32 = 6
    REAL32 = 9


_FLOAT_MAX = 3.4e38  # of a 32-bit float
_INT_RANGE = {ParamType.INT8: 7, ParamType.INT16: 15, ParamType.INT32: 31}


class Encoding(IntEnum):
    """How an integer is put in `param_value` (https://mavlink.io/en/services/parameter.html)."""

    C_CAST = 0  # ArduPilot: the number as a float
    BYTEWISE = 1  # PX4: the integer's bytes where the float's would be


@dataclass(frozen=True, slots=True)
class Param:
    """One parameter as it stands."""

    name: str
    index: int
    type: ParamType
    value: float


def _single(value: float) -> float:
    """What a 32-bit float keeps of it."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


def to_wire(param: Param, encoding: Encoding) -> float:
    """The float that goes into PARAM_VALUE."""
    if encoding is Encoding.BYTEWISE and param.type is not ParamType.REAL32:
        return float(struct.unpack("<f", struct.pack("<i", int(param.value)))[0])
    return _single(param.value)


def from_wire(wire: float, kind: ParamType, encoding: Encoding) -> float | None:
    """The value that a PARAM_SET asks for; None when it is no number of that type."""
    if encoding is Encoding.BYTEWISE and kind is not ParamType.REAL32:
        return float(struct.unpack("<i", struct.pack("<f", wire))[0])
    if not isfinite(wire):
        return None
    return wire if kind is ParamType.REAL32 else float(round(wire))


class ParamTable:
    """All parameters of one vehicle, in a fixed order."""

    def __init__(self, defaults: dict[str, tuple[ParamType, float]]) -> None:
        """Name to type and value; names of at most 16 characters (PARAM_VALUE.param_id)."""
        self._params = {
            name: Param(name, index, kind, _single(value))
            for index, (name, (kind, value)) in enumerate(sorted(defaults.items()))
        }
        self._names = list(self._params)

    def __len__(self) -> int:
        return len(self._names)

    def __iter__(self) -> Iterator[Param]:
        return iter(self._params.values())

    def __getitem__(self, name: str) -> float:
        return self._params[name].value

    def find(self, name: str, index: int = -1) -> Param | None:
        """By index if it is not negative, else by name (PARAM_REQUEST_READ)."""
        if index >= 0:
            return self._params[self._names[index]] if index < len(self._names) else None
        return self._params.get(name)

    def set(self, name: str, value: float) -> Param | None:
        """Stores a value if the name exists and the type can hold it; returns what stands afterwards."""
        old = self._params.get(name)
        if old is None:
            return None
        bits = _INT_RANGE.get(old.type)
        fits = abs(value) < _FLOAT_MAX if bits is None else -(2**bits) <= value < 2**bits
        if fits:  # never for NaN
            self._params[name] = Param(name, old.index, old.type, _single(value) if bits is None else value)
        return self._params[name]
