"""Messages to frames, byte for byte as pymavlink packs them.

Setpoints and time requests leave two thousand times a second for a hundred vehicles; what has only numbers is packed
here in one call. Texts, arrays and everything on a signed link go through pymavlink.
"""

from struct import Struct
from typing import Any, Final

from fastcrc.crc16 import mcrf4xx

from gcs.links.kinds import BY_NAME
from gcs.links.wire import OWN_COMPONENT_ID, OWN_SYSTEM_ID, Fields

_HEADER: Final = Struct("<BBBBBBBHB")  # marker, length, two flags, sequence, system, component, number in 2 + 1 bytes
_CHECKSUM: Final = Struct("<H")
_V2: Final = 0xFD


def frame_of(name: str, fields: Fields, codec: Any) -> bytes:
    """One frame with the codec's next sequence number, signed where it has a key; extensions may be left out.

    TypeError for a field that is missing or unknown, ``struct.error`` for a value that does not fit.
    """
    kind = BY_NAME[name]
    if not kind.is_plain or codec.signing.sign_outgoing:
        frame = bytes(kind.kind(**fields).pack(codec))
    else:
        values = {**kind.defaults, **fields}
        if values.keys() != kind.names:
            wrong = ", ".join(sorted(values.keys() ^ kind.names))
            raise TypeError(f"{name} has not been given these fields, or does not have them: {wrong}")
        payload = kind.struct.pack(*[values[field] for field in kind.fields])
        payload = payload.rstrip(b"\0") or payload[:1]
        head = (_V2, len(payload), 0, 0, codec.seq, OWN_SYSTEM_ID, OWN_COMPONENT_ID, kind.number & 0xFFFF)
        body = _HEADER.pack(*head, kind.number >> 16) + payload
        frame = body + _CHECKSUM.pack(mcrf4xx(body[1:] + kind.check))
    codec.seq = (codec.seq + 1) % 256
    return frame
