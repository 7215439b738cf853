"""Incremental parser: bytes in, frames out. Rubbish is counted and skipped, never raised."""

from __future__ import annotations

from dataclasses import dataclass, field

from sitl_mock.wire.checksum import x25
from sitl_mock.wire.definition import BY_ID
from sitl_mock.wire.frame import MAGIC_V1, MAGIC_V2, Frame, unpack_payload
from sitl_mock.wire.signing import SIGNATURE_SIZE, SIGNED_FLAG

_HEADER_V1, _HEADER_V2, _CRC = 6, 10, 2


@dataclass(slots=True)
class Parser:
    """One link's receive side. The buffer never outgrows one frame plus what was fed."""

    bad_checksums: int = 0
    unknown_messages: int = 0
    skipped_bytes: int = 0
    _buffer: bytearray = field(default_factory=bytearray)

    def feed(self, data: bytes) -> list[Frame]:
        """Takes received bytes and returns the frames that they complete, in order."""
        self._buffer += data
        frames: list[Frame] = []
        at = 0
        while True:
            at = self._next_magic(at)
            size = self._frame_size(at)
            if size == 0 or at + size > len(self._buffer):
                break
            frame = self._frame(bytes(self._buffer[at : at + size]))
            if isinstance(frame, Frame):
                frames.append(frame)
            at += size if frame else 1
        del self._buffer[:at]
        return frames

    def _next_magic(self, at: int) -> int:
        places = (self._buffer.find(MAGIC_V2, at), self._buffer.find(MAGIC_V1, at))
        found = min((place for place in places if place >= 0), default=len(self._buffer))
        self.skipped_bytes += found - at
        return found

    def _frame_size(self, at: int) -> int:
        """Size of the frame that starts here, 0 while too little of it is known."""
        left = len(self._buffer) - at
        if left < 3:
            return 0
        length = self._buffer[at + 1]
        if self._buffer[at] == MAGIC_V1:
            return _HEADER_V1 + length + _CRC
        signature = SIGNATURE_SIZE if self._buffer[at + 2] & SIGNED_FLAG else 0
        return _HEADER_V2 + length + _CRC + signature

    def _frame(self, raw: bytes) -> Frame | bool:
        """The frame, True for a whole one that means nothing here, False for what is no frame at all."""
        v2 = raw[0] == MAGIC_V2
        if v2 and raw[2] & ~SIGNED_FLAG:  # a flag that we don't know must not be guessed at
            return False
        header = _HEADER_V2 if v2 else _HEADER_V1
        msg_id = int.from_bytes(raw[7:10], "little") if v2 else raw[5]
        definition = BY_ID.get(msg_id)
        end = header + raw[1]
        if definition is None:
            self.unknown_messages += 1
            return False  # without its CRC_EXTRA nothing vouches for its length: look inside it again
        crc = x25(raw[1:end] + bytes((definition.crc_extra,)))
        if crc != int.from_bytes(raw[end : end + _CRC], "little"):
            self.bad_checksums += 1
            return False
        seq, system, component = raw[4:7] if v2 else raw[2:5]
        values = unpack_payload(definition, raw[header:end])
        return Frame(definition.name, system, component, seq, values, 2 if v2 else 1, v2 and bool(raw[2]), raw)
