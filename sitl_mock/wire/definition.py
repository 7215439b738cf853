"""Message definitions: from the table's text to field layout and CRC_EXTRA."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

from sitl_mock.wire.checksum import x25
from sitl_mock.wire.messages import TABLE

# Short name -> (struct code, size in bytes, C type as it enters CRC_EXTRA).
_TYPES = {
    "u8": ("B", 1, "uint8_t"),
    "i8": ("b", 1, "int8_t"),
    "char": ("s", 1, "char"),
    "u16": ("H", 2, "uint16_t"),
    "i16": ("h", 2, "int16_t"),
    "u32": ("I", 4, "uint32_t"),
    "i32": ("i", 4, "int32_t"),
    "f32": ("f", 4, "float"),
    "u64": ("Q", 8, "uint64_t"),
    "i64": ("q", 8, "int64_t"),
}


@dataclass(frozen=True, slots=True)
class Field:
    """One field; `length` 0 is a scalar, else an array (a string for `char`)."""

    name: str
    code: str
    size: int
    c_type: str
    length: int

    @property
    def format(self) -> str:
        """This field in the notation of `struct`."""
        return f"{self.length or ''}{self.code}"


@dataclass(frozen=True, slots=True)
class Definition:
    """One message: `fields` in wire order, base fields first, then the extensions."""

    msg_id: int
    name: str
    fields: tuple[Field, ...]
    crc_extra: int
    base_size: int  # bytes without extensions: the payload length of MAVLink 1
    layout: struct.Struct = field(repr=False)
    scalar: bool  # no arrays, no strings: one value a field

    @property
    def size(self) -> int:
        """Payload bytes before truncation."""
        return self.layout.size


def _field(text: str) -> Field:
    kind, name = text.split()
    short, _, rest = kind.partition("[")
    code, size, c_type = _TYPES[short]
    return Field(name, code, size, c_type, int(rest.rstrip("]") or 0))


def _crc_extra(name: str, base: list[Field]) -> int:
    data = f"{name} ".encode()
    for part in base:
        data += f"{part.c_type} {part.name} ".encode()
        if part.length:
            data += bytes([part.length])
    crc = x25(data)
    return (crc & 0xFF) ^ (crc >> 8)


def parse_line(line: str) -> Definition:
    """One table line to its definition. Base fields travel by falling size, extensions as written."""
    head, _, body = line.partition(":")
    msg_id, name = head.split()
    base_text, _, extra_text = body.partition("|")
    base = sorted((_field(part) for part in base_text.split(",")), key=lambda part: -part.size)
    extra = [_field(part) for part in extra_text.split(",")] if extra_text else []
    fields = (*base, *extra)
    return Definition(
        msg_id=int(msg_id),
        name=name,
        fields=fields,
        crc_extra=_crc_extra(name, base),
        base_size=sum(part.size * max(part.length, 1) for part in base),
        layout=struct.Struct("<" + "".join(part.format for part in fields)),
        scalar=all(part.length == 0 for part in fields),
    )


def _load(table: str) -> dict[int, Definition]:
    lines = table.replace("\n  ", " ").strip().splitlines()
    return {definition.msg_id: definition for definition in map(parse_line, lines)}


BY_ID: dict[int, Definition] = _load(TABLE)
BY_NAME: dict[str, Definition] = {definition.name: definition for definition in BY_ID.values()}
