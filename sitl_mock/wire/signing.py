"""MAVLink 2 message signing (https://mavlink.io/en/guide/message_signing.html).

A signature is the link id, a 48 bit time stamp (10 us since 2015-01-01) and the first 48 bits of
SHA-256(key, frame, link id, time stamp). Time stamps strictly grow per (system, component, link); the first of a
new stream may be at most a minute behind the newest seen.
"""

from __future__ import annotations

from hashlib import sha256
from hmac import compare_digest

SIGNED_FLAG = 0x01
SIGNATURE_SIZE = 13
_UNITS_A_S = 100_000  # 10 us
_EPOCH_2015_S = 1_420_070_400
_BEHIND_UNITS = 60 * _UNITS_A_S
_LAST_UNITS = 2**48 - 1
_MAX_STREAMS = 16  # MAVLINK_MAX_SIGNING_STREAMS: more are refused, not remembered


def timestamp_units(unix_s: float) -> int:
    """A time as signatures count it."""
    return round((unix_s - _EPOCH_2015_S) * _UNITS_A_S)


class Signer:
    """One autopilot's key and the time stamps that it has seen. Without a key everything passes unsigned."""

    def __init__(self, key: bytes | None = None, link_id: int = 0) -> None:
        """`key` of 32 bytes."""
        self._key, self._link_id = key, link_id
        self._newest = 0
        self._streams: dict[tuple[int, int, int], int] = {}
        self.refused = 0

    @property
    def active(self) -> bool:
        """Whether there is a key."""
        return self._key is not None

    def set_key(self, key: bytes, initial_timestamp: int) -> None:
        """SETUP_SIGNING: 32 zero bytes end signing."""
        self._key = key if any(key) else None
        self._newest = max(self._newest, min(initial_timestamp, _LAST_UNITS))
        self._streams.clear()

    def tell_time(self, unix_s: float) -> None:
        """The autopilot's own clock; the time stamp never goes back."""
        self._newest = max(self._newest, timestamp_units(unix_s))

    def _hash(self, frame: bytes, tail: bytes) -> bytes:
        assert self._key is not None
        return sha256(self._key + frame + tail).digest()[:6]

    def sign(self, frame: bytes) -> bytes:
        """Appends a signature to a frame whose header carries the flag."""
        self._newest = min(self._newest + 1, _LAST_UNITS)
        tail = bytes((self._link_id,)) + self._newest.to_bytes(6, "little")
        return frame + tail + self._hash(frame, tail)

    def accepts(self, raw: bytes, system: int, component: int, *, signed: bool) -> bool:
        """Whether a received frame (with its signature) may be believed; counts those that may not."""
        if self._key is None:
            return True
        good = signed and self._is_good(raw, system, component)
        self.refused += not good
        return good

    def _is_good(self, raw: bytes, system: int, component: int) -> bool:
        frame, tail, signature = raw[:-SIGNATURE_SIZE], raw[-SIGNATURE_SIZE:-6], raw[-6:]
        if not compare_digest(self._hash(frame, tail), signature):
            return False
        stream, stamp = (system, component, tail[0]), int.from_bytes(tail[1:], "little")
        last = self._streams.get(stream)
        if last is None and len(self._streams) >= _MAX_STREAMS:
            return False
        if stamp <= last if last is not None else stamp + _BEHIND_UNITS < self._newest:
            return False
        self._streams[stream] = stamp
        self._newest = max(self._newest, stamp)
        return True
