"""Telemetry logs as QGroundControl and MAVProxy read them: 8 bytes of big-endian Unix microseconds, then the frame.

Signatures and SETUP_SIGNING stay out (https://mavlink.io/en/guide/message_signing.html, "Logging"): a log that is
handed on must not help anybody to sign.
"""

import re
import struct
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Final, Self

from pymavlink.dialects.v20 import ardupilotmega as mavlink
from pymavlink.generator.mavcrc import x25crc

_MAGIC_2: Final = 0xFD
_SIGNED: Final = 0x01  # MAVLINK_IFLAG_SIGNED
_SIGNATURE_BYTES: Final = 13
_HEADER_BYTES: Final = 10
_SETUP_SIGNING: Final = 256


class TlogRecorder:
    """One file a link address, under ``folder``; ``epoch_s`` is the Unix time at zero of the flight clock."""

    def __init__(self, folder: Path, epoch_s: float) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder, self._epoch_s = folder, epoch_s
        self._files: dict[str, BinaryIO] = {}

    def record(self, address: str, now_s: float, frame: bytes) -> None:
        """Keep one frame, received or sent."""
        clean = without_secrets(frame)
        if clean is None:
            return
        stamp_us = int((self._epoch_s + now_s) * 1e6)
        self._file(address).write(struct.pack(">Q", stamp_us) + clean)

    def close(self) -> None:
        """Write what is buffered."""
        for file in self._files.values():
            file.close()
        self._files.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def _file(self, address: str) -> BinaryIO:
        file = self._files.get(address)
        if file is None:
            name = re.sub(r"[^A-Za-z0-9.]+", "-", address).strip("-")
            file = self._files[address] = (self._folder / f"{name}.tlog").open("wb")
        return file


def without_secrets(frame: bytes) -> bytes | None:
    """The frame without its signature; None for SETUP_SIGNING and for a signed frame that nobody could read."""
    if len(frame) < _HEADER_BYTES + 2 or frame[0] != _MAGIC_2:
        return frame
    number = int.from_bytes(frame[7:10], "little")
    if number == _SETUP_SIGNING:
        return None
    if not frame[2] & _SIGNED:
        return frame
    kind = mavlink.mavlink_map.get(number)
    if kind is None:
        return None
    body = bytearray(frame[: len(frame) - _SIGNATURE_BYTES - 2])
    body[2] &= ~_SIGNED & 0xFF
    check = x25crc(bytes(body[1:]))
    check.accumulate(bytes([kind.crc_extra]))
    return bytes(body) + struct.pack("<H", check.crc)
