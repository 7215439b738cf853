"""One peer's bytes to messages, as pymavlink's parser reads them, at a tenth of its cost.

pymavlink makes a large object of every frame: fifty a second from each of a hundred vehicles took half a core. Here
the header says which kind a frame is, the checksum (CRC-16/MCRF4XX) is always looked at, and the fields are unpacked
in one call where somebody reads them. Whatever is rare goes through pymavlink as ever: version 1, signed frames, texts,
unknown kinds, and every frame of a link that has a key. ``tests/links/test_link_frame_reader.py`` holds the two
against each other (https://mavlink.io/en/guide/serialization.html).
"""

from collections.abc import Callable
from typing import Any, Final

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from gcs.links.kinds import BY_NUMBER
from gcs.links.wire import Heard, Path

_V1, _V2 = 0xFE, 0xFD
_SIGNED: Final = 0x01  # MAVLINK_IFLAG_SIGNED
_SIGNATURE_BYTES: Final = 13
_V1_FRAME_BYTES, _V2_FRAME_BYTES = 8, 12
"""A frame without its payload."""
_V2_HEADER_BYTES: Final = 10
_SIZES_AT: Final = 3
"""With so many bytes of a frame its size is known."""

Keep = Callable[[bytes], None]


class FrameReader:
    """``codec``: pymavlink's, for what is not read here; it holds the key of a signed link."""

    def __init__(self, path: Path, codec: Any) -> None:
        self._path, self._codec = path, codec
        self._rest = b""

    def feed(self, data: bytes, keep: Keep | None = None) -> list[Heard]:
        """Messages that are complete now; rubbish, broken and unsigned frames are left out. ``keep`` gets the rest."""
        if self._rest:
            data = self._rest + data
        at, end, heard = 0, len(data), []
        while end - at >= _SIZES_AT:
            size = _size(data, at)
            if size == 0:
                at = _next_marker(data, at + 1)
                continue
            if end - at < size:
                break
            frame = data[at : at + size]
            at += size
            message = self._read(frame)
            if message is not None:
                if keep is not None:
                    keep(frame)
                heard.append(message)
        self._rest = data[at:]
        return heard

    def _read(self, frame: bytes) -> Heard | None:
        """One whole frame; None for a broken one."""
        if frame[0] != _V2 or frame[2] != 0 or self._codec.signing.secret_key is not None:
            return self._by_pymavlink(frame)
        kind = BY_NUMBER.get(frame[7] | frame[8] << 8 | frame[9] << 16)
        if kind is None or (kind.is_read and kind.has_text):
            return self._by_pymavlink(frame)
        if mcrf4xx(frame[1:-2] + kind.check) != frame[-2] | frame[-1] << 8:
            return None
        body = None
        if kind.is_read:  # zeros at the payload's end are not sent; what is longer is of a newer definition
            body = kind.body(kind.struct.unpack_from(frame[_V2_HEADER_BYTES:-2].ljust(kind.size, b"\0")))
        return Heard(self._path, kind.name, frame[5], frame[6], frame[4], body)

    def _by_pymavlink(self, frame: bytes) -> Heard | None:
        if frame[0] == _V2 and frame[2] & ~_SIGNED:
            return None  # incompatible: a flag that nobody here knows
        try:
            message = self._codec.decode(bytearray(frame))
        except mavlink.MAVError:
            return None
        origin = message.get_srcSystem(), message.get_srcComponent(), message.get_seq()  # 0 of an unknown kind
        return Heard(self._path, message.get_type(), *origin, message)


def _size(data: bytes, at: int) -> int:
    """Bytes of the frame that begins here; 0 where none does."""
    marker = data[at]
    if marker == _V2:
        return _V2_FRAME_BYTES + data[at + 1] + (_SIGNATURE_BYTES if data[at + 2] & _SIGNED else 0)
    return _V1_FRAME_BYTES + data[at + 1] if marker == _V1 else 0


def _next_marker(data: bytes, at: int) -> int:
    """Where a frame may begin next, or the end."""
    found = [place for place in (data.find(_V1, at), data.find(_V2, at)) if place >= 0]
    return min(found, default=len(data))
