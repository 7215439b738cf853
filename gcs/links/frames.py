"""Where frames begin and end in a stream of bytes, by their headers alone (https://mavlink.io/en/guide/serialization)."""

from dataclasses import dataclass

_V1, _V2 = 0xFE, 0xFD
_SIGNED = 0x01


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame as it stands on the wire; its checksum is for the library that decodes it."""

    sequence: int
    system_id: int
    component_id: int
    message_id: int
    data: bytes


class FrameCutter:
    """Takes bytes as they come (datagrams, a TCP or serial stream) and gives whole frames; rubbish is skipped."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Frames that are complete now."""
        self._rest += data
        frames: list[Frame] = []
        while True:
            begin = min((at for at in (self._rest.find(_V1), self._rest.find(_V2)) if at >= 0), default=-1)
            if begin < 0:
                self._rest = b""
                return frames
            self._rest = self._rest[begin:]
            frame = _first(self._rest)
            if frame is None:
                return frames
            frames.append(frame)
            self._rest = self._rest[len(frame.data) :]


def _first(data: bytes) -> Frame | None:
    if len(data) < 10:
        return None
    if data[0] == _V1:
        size, sequence, system, component, number = 8 + data[1], data[2], data[3], data[4], data[5]
    else:
        size = 12 + data[1] + (13 if data[2] & _SIGNED else 0)
        sequence, system, component = data[4], data[5], data[6]
        number = int.from_bytes(data[7:10], "little")
    if len(data) < size:
        return None
    return Frame(sequence, system, component, number, data[:size])
