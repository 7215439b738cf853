"""The default link: every vehicle over pymavlink in one process, without ever waiting."""

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from gcs.links.fleet_link import Clock, WiredFleetLink
from gcs.links.frame_reader import FrameReader
from gcs.links.frame_writer import frame_of
from gcs.links.signing import SigningKey
from gcs.links.tlog import TlogRecorder
from gcs.links.transport import Peer, Transport, open_all, troubles_of
from gcs.links.wire import OWN_COMPONENT_ID, OWN_SYSTEM_ID, Fields, Heard, Path

_LOOSE_TYPES: Final = {"param_id": lambda text: text.encode("ascii")}


class PymavlinkFleetLink(WiredFleetLink):
    """:class:`gcs.ports.FleetLink` over UDP, TCP and serial addresses (see :mod:`gcs.links.transport`)."""

    def __init__(
        self,
        addresses: Sequence[str],
        expected: Mapping[str, int] | None = None,
        recorder: TlogRecorder | None = None,
        signing: SigningKey | None = None,
        clock: Clock | None = None,
    ) -> None:
        super().__init__(PymavlinkWire(open_all(addresses), recorder, signing), expected, clock)


class PymavlinkWire:
    """:class:`gcs.links.wire.Wire`: one reader a peer, one sender (with its own link id for signing) a transport."""

    def __init__(
        self,
        transports: Sequence[Transport],
        recorder: TlogRecorder | None = None,
        signing: SigningKey | None = None,
        wall_s: Callable[[], float] = time.time,
    ) -> None:
        self._transports = {transport.address: transport for transport in transports}
        self._recorder, self._signing, self._wall_s = recorder, signing, wall_s
        self._readers: dict[tuple[str, Peer], FrameReader] = {}
        self._senders = {address: _codec() for address in self._transports}
        if signing is not None:
            for link_id, sender in enumerate(self._senders.values()):
                signing.sign_with(sender, link_id, wall_s())

    def read(self, now_s: float) -> list[Heard]:
        """Everything that is waiting on every transport; rubbish and unsigned frames are left out."""
        heard: list[Heard] = []
        for transport in self._transports.values():
            keep = None if self._recorder is None else partial(self._recorder.record, transport.address, now_s)
            for peer, data in transport.read(now_s):
                heard += self._reader(transport.address, peer).feed(data, keep)
        return heard

    def write(self, name: str, fields: Fields, paths: Sequence[Path], now_s: float) -> None:
        """One frame a transport (each counts its own sequence), to one peer or to everyone there."""
        values = {key: _LOOSE_TYPES[key](value) if key in _LOOSE_TYPES else value for key, value in fields.items()}
        targets: list[tuple[str, Peer | None]] = [(path.address, path.peer) for path in paths]
        for address, peer in targets or [(address, None) for address in self._transports]:
            sender = self._senders[address]
            if self._signing is not None:
                self._signing.tell_time(sender, self._wall_s())
            frame = frame_of(name, values, sender)
            self._record(address, now_s, frame)
            self._transports[address].write(frame, peer)

    def skipped(self) -> dict[str, int]:
        """Datagrams thrown away unread so far, by address."""
        return {address: transport.skipped for address, transport in self._transports.items()}

    def troubles(self) -> list[str]:
        """What could not be sent, read or logged since the last call, for operators."""
        log = [] if self._recorder is None else self._recorder.take_troubles()
        return [*troubles_of(self._transports.values()), *log]

    def close(self) -> None:
        """Release all sockets."""
        for transport in self._transports.values():
            transport.close()

    def _reader(self, address: str, peer: Peer) -> FrameReader:
        reader = self._readers.get((address, peer))
        if reader is None:
            codec = _codec()
            if self._signing is not None:
                self._signing.check_with(codec, self._wall_s())
            reader = self._readers[address, peer] = FrameReader(Path(address, peer), codec)
        return reader

    def _record(self, address: str, now_s: float, frame: bytes) -> None:
        if self._recorder is not None:
            self._recorder.record(address, now_s, frame)


class _Codec(mavlink.MAVLink):  # type: ignore[misc]
    """pymavlink notes a stream's time stamp before it has checked the signature: a forged one would end the stream."""

    def check_signature(self, msgbuf: bytearray, srcSystem: int, srcComponent: int) -> bool:  # noqa: N803
        """As pymavlink's, but a frame that is refused leaves no trace."""
        stream = (msgbuf[-13], srcSystem, srcComponent)
        newest = self.signing.stream_timestamps.get(stream)
        good = bool(super().check_signature(msgbuf, srcSystem, srcComponent))
        if not good and newest is not None:
            self.signing.stream_timestamps[stream] = newest
        elif not good:
            self.signing.stream_timestamps.pop(stream, None)
        return good


def _codec() -> Any:
    codec = _Codec(None, srcSystem=OWN_SYSTEM_ID, srcComponent=OWN_COMPONENT_ID)
    codec.robust_parsing = True
    return codec
