"""Signing on our side against pymavlink's own signer, with a key that shows itself nowhere."""

import logging
import pickle
from pathlib import Path

import pytest
from link_peer import Desk, Passed, Peer

from gcs.links.opening import addresses_of, open_link
from gcs.links.pymavlink_link import PymavlinkFleetLink
from gcs.links.signing import SigningKey, read_key
from gcs.links.tlog import TlogRecorder
from gcs.links.transport import LinkError
from gcs.ports import VelocitySetpoint

KEY = bytes(range(1, 33))


def met(desk: Desk, peer: Peer) -> None:
    desk.receive(peer, "HEARTBEAT")

    def known() -> bool:
        peer.heartbeat()
        return 1 in desk.link.vehicles()

    desk.until(known)


@pytest.fixture
def key_file(tmp_path: Path) -> Path:
    path = tmp_path / "signing.hex"
    path.write_text(KEY.hex() + "\n")
    path.chmod(0o600)
    return path


def test_signed_both_ways_and_the_log_has_neither_key_nor_signature(tmp_path: Path, key_file: Path) -> None:
    peer = Peer(key=KEY)
    with TlogRecorder(tmp_path / "log", 0.0) as recorder:
        desk = Desk(open_link({1: peer.address}, signing_key=key_file, recorder=recorder))
        met(desk, peer)
        desk.link.send(Passed(VelocitySetpoint(1, (1.0, 2.0, 3.0), 0.0)), desk.now_s)
        message = desk.receive(peer, "SET_POSITION_TARGET_GLOBAL_INT")
        assert message.get_signed()
        signature = bytes(message.get_msgbuf())[-6:]
        desk.link.close()
    (log,) = (tmp_path / "log").glob("*.tlog")
    recorded = log.read_bytes()
    assert b"\x00" + KEY[:8] not in recorded
    assert signature not in recorded
    assert peer.codec.signing.badsig_count == 0
    peer.close()


@pytest.mark.parametrize("key", [None, bytes(32 * [9])])
def test_unsigned_and_wrongly_signed_vehicles_are_not_believed(key: bytes | None, key_file: Path) -> None:
    peer = Peer()
    desk = Desk(open_link({1: peer.address}, signing_key=key_file))
    desk.receive(peer, "HEARTBEAT")
    if key is not None:
        peer.sign(key)
    for _ in range(20):
        peer.heartbeat()
        desk.tick()
    assert not desk.link.vehicles()
    desk.link.close()
    peer.close()


def test_a_repeated_frame_is_not_believed_and_a_forged_time_stamp_does_no_harm(key_file: Path) -> None:
    peer = Peer(key=KEY)
    desk = Desk(open_link({1: peer.address}, signing_key=key_file))
    met(desk, peer)
    old = bytes(peer.codec.heartbeat_encode(2, 12, 128, 3 << 16, 4).pack(peer.codec))
    peer.socket.sendto(old, peer.ground)
    desk.until(lambda: desk.link.vehicles()[1].mode_name == "POSCTL")
    peer.heartbeat()
    desk.until(lambda: desk.link.vehicles()[1].mode_name == "OFFBOARD")
    forged = bytearray(old)
    forged[-12:-6] = b"\xff" * 6  # the last time stamp there is, with a signature that cannot fit
    for frame in (old, bytes(forged)):
        peer.socket.sendto(frame, peer.ground)
    for _ in range(10):
        desk.tick()
    assert desk.link.vehicles()[1].mode_name == "OFFBOARD"
    peer.heartbeat(custom=3 << 16)
    desk.until(lambda: desk.link.vehicles()[1].mode_name == "POSCTL")
    desk.link.close()
    peer.close()


def test_the_key_shows_itself_nowhere(key_file: Path, caplog: pytest.LogCaptureFixture) -> None:
    key = read_key(key_file)
    with caplog.at_level(logging.DEBUG):
        logging.getLogger("test").warning("the key is %s %r", key, key)
        link = PymavlinkFleetLink(["udpout:127.0.0.1:9"], signing=key)
        logging.getLogger("test").warning("%r %s", link, vars(link))
        link.close()
    assert KEY.hex()[:16] not in caplog.text
    assert repr(KEY)[2:20] not in caplog.text
    with pytest.raises(TypeError, match="not to be copied"):
        pickle.dumps(key)


def test_a_key_file_that_others_may_read_is_refused(key_file: Path) -> None:
    key_file.chmod(0o644)
    with pytest.raises(LinkError, match="chmod 600"):
        read_key(key_file)


@pytest.mark.parametrize("text", ["", "00" * 31, "zz" * 32])
def test_a_bad_key_says_how_to_make_one_and_not_what_it_is(text: str, key_file: Path) -> None:
    key_file.write_text(text)
    with pytest.raises(LinkError, match="openssl rand") as caught:
        read_key(key_file)
    assert not text or text not in str(caught.value)
    with pytest.raises(LinkError, match="32 bytes"):
        SigningKey(b"short")


def test_a_missing_key_file_and_a_link_that_cannot_sign(tmp_path: Path, key_file: Path) -> None:
    with pytest.raises(LinkError, match="cannot be read"):
        read_key(tmp_path / "none.hex")
    with pytest.raises(LinkError, match="cannot sign"):
        open_link({1: "udpout:127.0.0.1:9"}, "mavsdk", signing_key=key_file)
    with pytest.raises(LinkError, match="not known"):
        open_link({1: "udpout:127.0.0.1:9"}, "semaphore")


def test_several_links_of_one_drone_and_several_drones_at_one_port() -> None:
    several = addresses_of({1: "udpout:a:1, serial:/dev/x:57600", 2: "udpin:b:2", 3: "udpin:b:2"})
    assert several == {"udpout:a:1": 1, "serial:/dev/x:57600": 1, "udpin:b:2": None}
