"""The default link: every vehicle over pymavlink in one process, without ever waiting."""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import fastcrc
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from gcs.links.fleet_link import WiredFleetLink
from gcs.links.signing import SigningKey
from gcs.links.tlog import TlogRecorder
from gcs.links.transport import Peer, Transport, open_all
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
    ) -> None:
        super().__init__(PymavlinkWire(open_all(addresses), recorder, signing), expected)


class PymavlinkWire:
    """:class:`gcs.links.wire.Wire`: one parser a peer, one sender (with its own link id for signing) a transport."""

    def __init__(
        self,
        transports: Sequence[Transport],
        recorder: TlogRecorder | None = None,
        signing: SigningKey | None = None,
        wall_s: Callable[[], float] = time.time,
    ) -> None:
        self._transports = {transport.address: transport for transport in transports}
        self._recorder, self._signing, self._wall_s = recorder, signing, wall_s
        self._parsers: dict[Path, Any] = {}
        self._senders = {address: _codec() for address in self._transports}
        if signing is not None:
            for link_id, sender in enumerate(self._senders.values()):
                signing.sign_with(sender, link_id, wall_s())

    def read(self, now_s: float) -> list[Heard]:
        """Everything that is waiting on every transport; rubbish and unsigned frames are left out."""
        heard = []
        for transport in self._transports.values():
            for peer, data in transport.read(now_s):
                path = Path(transport.address, peer)
                for message in self._parser(path).parse_buffer(data) or ():
                    if message.get_type() == "BAD_DATA":
                        continue
                    if self._recorder is not None:
                        self._record(transport.address, now_s, bytes(message.get_msgbuf()))
                    heard.append(
                        Heard(
                            path,
                            message.get_type(),
                            message.get_srcSystem(),
                            message.get_srcComponent(),
                            message.get_seq(),
                            None if isinstance(message, _Unread) else message,
                        )
                    )
        return heard

    def write(self, name: str, fields: Fields, paths: Sequence[Path], now_s: float) -> None:
        """One frame a transport (each counts its own sequence), to one peer or to everyone there."""
        kind = _KINDS[name]
        values = {key: _LOOSE_TYPES[key](value) if key in _LOOSE_TYPES else value for key, value in fields.items()}
        targets: list[tuple[str, Peer | None]] = [(path.address, path.peer) for path in paths]
        for address, peer in targets or [(address, None) for address in self._transports]:
            sender = self._senders[address]
            if self._signing is not None:
                self._signing.tell_time(sender, self._wall_s())
            frame = bytes(kind(**values).pack(sender))
            sender.seq = (sender.seq + 1) % 256
            self._record(address, now_s, frame)
            self._transports[address].write(frame, peer)

    def skipped(self) -> dict[str, int]:
        """Datagrams thrown away unread so far, by address."""
        return {address: transport.skipped for address, transport in self._transports.items()}

    def close(self) -> None:
        """Release all sockets."""
        for transport in self._transports.values():
            transport.close()

    def _parser(self, path: Path) -> Any:
        parser = self._parsers.get(path)
        if parser is None:
            parser = self._parsers[path] = _codec()
            if self._signing is not None:
                self._signing.check_with(parser, self._wall_s())
        return parser

    def _record(self, address: str, now_s: float, frame: bytes) -> None:
        if self._recorder is not None:
            self._recorder.record(address, now_s, frame)


_KINDS: Final[dict[str, Any]] = {kind.msgname: kind for kind in mavlink.mavlink_map.values()}


_UNREAD: Final = {  # numerous in a usual set of streams, and nothing here asks what they say
    kind.id: kind
    for kind in (
        mavlink.MAVLink_gps_raw_int_message,
        mavlink.MAVLink_scaled_imu_message,
        mavlink.MAVLink_raw_imu_message,
        mavlink.MAVLink_scaled_pressure_message,
        mavlink.MAVLink_attitude_quaternion_message,
        mavlink.MAVLink_local_position_ned_message,
        mavlink.MAVLink_servo_output_raw_message,
        mavlink.MAVLink_nav_controller_output_message,
        mavlink.MAVLink_rc_channels_message,
        mavlink.MAVLink_vfr_hud_message,
        mavlink.MAVLink_attitude_target_message,
        mavlink.MAVLink_position_target_local_ned_message,
        mavlink.MAVLink_position_target_global_int_message,
        mavlink.MAVLink_highres_imu_message,
        mavlink.MAVLink_scaled_imu2_message,
        mavlink.MAVLink_altitude_message,
        mavlink.MAVLink_vibration_message,
        mavlink.MAVLink_ahrs2_message,
    )
}
_V2_HEADER: Final = 10


class _Unread:
    """A frame whose header and checksum are good; what it carries was not looked at."""

    __slots__ = ("_frame", "_kind")

    def __init__(self, kind: Any, frame: bytearray) -> None:
        self._kind, self._frame = kind, frame

    def get_type(self) -> str:
        """As pymavlink's messages."""
        return str(self._kind.msgname)

    def get_srcSystem(self) -> int:  # noqa: N802
        """Byte 5 of a version 2 frame."""
        return self._frame[5]

    def get_srcComponent(self) -> int:  # noqa: N802
        """Byte 6."""
        return self._frame[6]

    def get_seq(self) -> int:
        """Byte 4."""
        return self._frame[4]

    def get_msgbuf(self) -> bytearray:
        """The whole frame."""
        return self._frame


class _Codec(mavlink.MAVLink):  # type: ignore[misc]
    """pymavlink notes a stream's time stamp before it has checked the signature: a forged one would end the stream.

    Its ``decode`` makes an object of every message: with fifty a second from each of a hundred vehicles that is half of
    the flight's time, so frames that nobody reads are only checked. A signed link decodes everything.
    """

    def decode(self, msgbuf: bytearray) -> Any:
        """The message, or an :class:`_Unread`; MAVError for a frame that is broken."""
        kind = _UNREAD.get(msgbuf[7] | msgbuf[8] << 8 | msgbuf[9] << 16) if len(msgbuf) > _V2_HEADER else None
        plain = msgbuf[0] == mavlink.PROTOCOL_MARKER_V2 and msgbuf[2] == 0 and self.signing.secret_key is None
        if kind is None or not plain:
            return super().decode(msgbuf)
        told = int.from_bytes(msgbuf[-2:], "little")
        if fastcrc.crc16.mcrf4xx(bytes(msgbuf[1:-2]) + bytes((kind.crc_extra,))) != told:
            raise mavlink.MAVError(f"invalid MAVLink CRC in {kind.msgname}")
        return _Unread(kind, msgbuf)

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
