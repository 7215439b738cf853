"""CRC-16/MCRF4XX ("X.25" in MAVLink: reflected polynomial 0x1021, start 0xFFFF, no final inversion).

The standard library has the same polynomial unreflected and compiled (`binascii.crc_hqx`): feeding it
bit-reversed bytes and reversing the result gives the reflected sum at C speed.
"""

from __future__ import annotations

from binascii import crc_hqx

_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def x25(data: bytes, start: int = 0xFFFF) -> int:
    """Checksum of `data`; `start` is the bit-reversed running value (0xFFFF is its own mirror)."""
    crc = crc_hqx(data.translate(_REVERSED), start)
    return _REVERSED[crc & 0xFF] << 8 | _REVERSED[crc >> 8]
