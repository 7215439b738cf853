"""Frames: message values to MAVLink 2 bytes and payload bytes back to values."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from math import isfinite
from typing import TYPE_CHECKING, Any

from sitl_mock.wire.checksum import x25
from sitl_mock.wire.definition import BY_NAME, Definition, Field

if TYPE_CHECKING:
    from collections.abc import Mapping

MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
BROADCAST = 0
_HEADER = struct.Struct("<BBBBBBBHB")  # magic, length, incompat, compat, seq, system, component, id low 16, id high 8


@dataclass(frozen=True, slots=True)
class Frame:
    """One received message. `values` holds Python numbers, tuples for arrays and str for char arrays."""

    name: str
    system: int
    component: int
    seq: int
    values: Mapping[str, Any]
    version: int = 2
    signed: bool = field(default=False)
    raw: bytes = field(default=b"", repr=False)  # as received, with its signature

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def finite(self, *names: str) -> bool:
        """Whether these float fields hold neither NaN nor infinity."""
        return all(isfinite(self.values[name]) for name in names)


def _flat(part: Field, value: Any) -> tuple[Any, ...]:
    if part.code == "s":
        return (value.encode("ascii", "replace") if isinstance(value, str) else value,)
    return tuple(value) if part.length else (value,)


def pack_payload(definition: Definition, values: Mapping[str, Any]) -> bytes:
    """Payload with trailing zeros cut (at least one byte stays). Missing extension fields are zero."""
    flat: list[Any] = []
    if definition.scalar:
        flat = [values.get(part.name, 0) for part in definition.fields]
    else:
        for part in definition.fields:
            empty: Any = b"" if part.code == "s" else (0,) * part.length if part.length else 0
            flat.extend(_flat(part, values.get(part.name, empty)))
    payload = definition.layout.pack(*flat)
    return payload.rstrip(b"\0") or b"\0"


def unpack_payload(definition: Definition, payload: bytes) -> dict[str, Any]:
    """Values of a payload that may be cut short (zeros fill it) or longer than known (the rest drops)."""
    size = definition.layout.size
    flat = definition.layout.unpack(payload[:size].ljust(size, b"\0"))
    if definition.scalar:
        return {part.name: value for part, value in zip(definition.fields, flat, strict=True)}
    values: dict[str, Any] = {}
    at = 0
    for part in definition.fields:
        if part.code == "s":
            values[part.name] = flat[at].split(b"\0", 1)[0].decode("ascii", "replace")
            at += 1
        elif part.length:
            values[part.name] = flat[at : at + part.length]
            at += part.length
        else:
            values[part.name] = flat[at]
            at += 1
    return values


def encode(name: str, values: Mapping[str, Any], *, system: int, component: int, seq: int, flags: int = 0) -> bytes:
    """One MAVLink 2 frame without a signature; `flags` are the incompatibility flags."""
    definition = BY_NAME[name]
    payload = pack_payload(definition, values)
    msg_id = definition.msg_id
    head = _HEADER.pack(MAGIC_V2, len(payload), flags, 0, seq & 0xFF, system, component, msg_id & 0xFFFF, msg_id >> 16)
    body = head + payload
    return body + x25(body[1:] + bytes((definition.crc_extra,))).to_bytes(2, "little")
