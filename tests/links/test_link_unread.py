"""Messages that nobody reads are checked and counted, and not taken apart; those that count are read as ever."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from gcs.links.pymavlink_link import PymavlinkWire
from gcs.links.signing import SigningKey
from gcs.links.status import changed
from gcs.links.transport import Peer
from gcs.ports import VehicleStatus

KEY = bytes(range(32))


@dataclass
class Datagrams:
    """A transport that has what it is given."""

    waiting: list[bytes] = field(default_factory=list)
    address: str = "test"

    def read(self, now_s: float) -> Sequence[tuple[Peer, bytes]]:
        given, self.waiting = self.waiting, []
        return [(("127.0.0.1", 1), data) for data in given]

    def write(self, data: bytes, peer: Peer | None) -> None: ...

    def close(self) -> None: ...


@dataclass
class Recorder:
    frames: list[bytes] = field(default_factory=list)

    def record(self, address: str, now_s: float, frame: bytes) -> None:
        self.frames.append(frame)


def frames(signed: bool = False) -> list[bytes]:
    codec = mav.MAVLink(None, srcSystem=7, srcComponent=1)
    if signed:
        codec.signing.secret_key, codec.signing.sign_outgoing = KEY, True
        codec.signing.timestamp = round((time.time() - 1_420_070_400) * 1e5)  # 10 us since 2015
    said = [
        codec.vfr_hud_encode(1.0, 2.0, 90, 50, 30.0, 0.1),
        codec.attitude_encode(1000, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0),
        codec.local_position_ned_encode(1000, 1.0, 2.0, -3.0, 0.0, 0.0, 0.0),
    ]
    made = []
    for number, message in enumerate(said):
        codec.seq = 10 + number
        made.append(bytes(message.pack(codec)))
    return made


def test_they_are_named_counted_and_recorded_but_have_no_body() -> None:
    recorder, sent = Recorder(), frames()
    wire = PymavlinkWire([Datagrams([b"".join(sent)])], recorder)  # type: ignore[list-item, arg-type]
    heard = wire.read(0.0)
    assert [(h.name, h.system_id, h.component_id, h.sequence, h.body is None) for h in heard] == [
        ("VFR_HUD", 7, 1, 10, True),
        ("ATTITUDE", 7, 1, 11, False),
        ("LOCAL_POSITION_NED", 7, 1, 12, True),
    ]
    assert heard[1].body.yaw == pytest.approx(0.3)
    assert recorder.frames == sent


@pytest.mark.parametrize("place", [4, 12, -1])
def test_a_broken_one_is_not_counted(place: int) -> None:
    broken, good, _ = (bytearray(frame) for frame in frames())
    broken[place] ^= 0x40
    heard = PymavlinkWire([Datagrams([bytes(broken + good)])]).read(0.0)  # type: ignore[list-item]
    assert [h.name for h in heard] == ["ATTITUDE"]


def test_on_a_signed_link_they_are_believed_only_when_signed() -> None:
    key = SigningKey(KEY)
    wire = PymavlinkWire([Datagrams([*frames(), *frames(signed=True)])], signing=key)  # type: ignore[list-item]
    heard = wire.read(0.0)
    assert [h.name for h in heard] == ["VFR_HUD", "ATTITUDE", "LOCAL_POSITION_NED"]
    assert all(h.body is not None for h in heard)


def test_a_changed_status_is_what_dataclasses_make_of_it() -> None:
    status = VehicleStatus(3, autopilot="px4", texts=("a",))
    made = changed(status, armed=True, lat_deg=40.0)
    assert made == replace(status, armed=True, lat_deg=40.0)
    assert status == VehicleStatus(3, autopilot="px4", texts=("a",)), "the old one stays as it was"
