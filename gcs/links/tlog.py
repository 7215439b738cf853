"""Telemetry logs as QGroundControl and MAVProxy read them: 8 bytes of big-endian Unix microseconds, then the frame.

Signatures and SETUP_SIGNING stay out (https://mavlink.io/en/guide/message_signing.html, "Logging"): a log that is
handed on must not help anybody to sign.
"""

import re
import struct
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Final, Self

from pymavlink.dialects.v20 import ardupilotmega as mavlink
from pymavlink.generator.mavcrc import x25crc

from gcs.links.transport import LinkError

_MAGIC_2: Final = 0xFD
_SIGNED: Final = 0x01  # MAVLINK_IFLAG_SIGNED
_SIGNATURE_BYTES: Final = 13
_HEADER_BYTES: Final = 10
_SETUP_SIGNING: Final = 256


class TlogRecorder:
    """One file a link address, under ``folder``; ``epoch_s`` is the Unix time at zero of the flight clock.

    Its UTC begins each file's name: a later flight into the same folder keeps the earlier one's. A log that cannot be
    written any more (a full disk) ends and is told; the flight goes on.
    """

    def __init__(self, folder: Path, epoch_s: float) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            words = error.strerror or error
            raise LinkError(
                f"folder '{folder}' for telemetry logs cannot be made: {words}; name another one"
            ) from error
        self._folder, self._epoch_s = folder, epoch_s
        self._files: dict[str, BinaryIO] = {}
        self._ended: set[str] = set()
        self._troubles: list[str] = []

    def record(self, address: str, now_s: float, frame: bytes) -> None:
        """Keep one frame, received or sent."""
        clean = without_secrets(frame)
        if clean is None or address in self._ended:
            return
        stamp_us = int((self._epoch_s + now_s) * 1e6)
        try:
            self._file(address).write(struct.pack(">Q", stamp_us) + clean)
        except OSError as error:
            self._end(address, error)

    def take_troubles(self) -> list[str]:
        """Which logs have ended since the last call, and why."""
        troubles, self._troubles = self._troubles, []
        return troubles

    def close(self) -> None:
        """Write what is buffered."""
        for file in self._files.values():
            with suppress(OSError):
                file.close()
        self._files.clear()

    def _end(self, address: str, error: OSError) -> None:
        self._ended.add(address)
        self._troubles.append(
            f"{address}: its telemetry log in {self._folder} has ended ({error.strerror or error}); make room there"
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def _file(self, address: str) -> BinaryIO:
        file = self._files.get(address)
        if file is None:
            name = re.sub(r"[^A-Za-z0-9.]+", "-", address).strip("-")
            begun = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime(self._epoch_s))
            file = self._files[address] = (self._folder / f"{begun}-{name}.tlog").open("ab")
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
