"""Telemetry logs that pymavlink opens, free of secrets, and the round-trip time of a link."""

import subprocess
import sys
import time
from pathlib import Path

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from gcs.links.latency import LatencyMeter
from gcs.links.tlog import TlogRecorder, without_secrets
from gcs.links.transport import LinkError

EPOCH_S = 1_700_000_000.0


def sender(*, signed: bool = False) -> mavlink.MAVLink:
    codec = mavlink.MAVLink(None, srcSystem=7, srcComponent=1)
    if signed:
        codec.signing.secret_key = bytes(range(32))
        codec.signing.sign_outgoing = True
        codec.signing.timestamp = 1
    return codec


def frame(codec: mavlink.MAVLink, message: mavlink.MAVLink_message) -> bytes:
    return bytes(message.pack(codec))


def test_a_log_opens_in_pymavlink_with_times_and_messages(tmp_path: Path) -> None:
    codec = sender()
    with TlogRecorder(tmp_path, EPOCH_S) as recorder:
        for second in range(3):
            sent = codec.attitude_encode(1000 * second, 0.1 * second, 0.0, 1.0, 0.0, 0.0, 0.0)
            recorder.record("udpout:127.0.0.1:14550", float(second), frame(codec, sent))
    (path,) = tmp_path.glob("*.tlog")
    assert path.name == f"{time.strftime('%Y%m%dT%H%M%SZ', time.gmtime(EPOCH_S))}-udpout-127.0.0.1-14550.tlog"
    log = mavutil.mavlogfile(str(path), notimestamps=False)
    read = [log.recv_match(blocking=False) for _ in range(3)]
    assert [message.time_boot_ms for message in read] == [0, 1000, 2000]
    assert [message._timestamp - EPOCH_S for message in read] == [0.0, 1.0, 2.0]
    log.close()


def test_the_tools_that_come_with_mavproxy_open_it(tmp_path: Path) -> None:
    codec = sender()
    armed = mavlink.MAV_MODE_FLAG_SAFETY_ARMED | mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    with TlogRecorder(tmp_path, EPOCH_S) as recorder:
        for second, mode in enumerate((4, 4, 4, 6)):  # of a copter: GUIDED, RTL
            beat = codec.heartbeat_encode(
                mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, armed, mode, 4
            )
            recorder.record("udpout:127.0.0.1:14550", float(second), frame(codec, beat))
        said = codec.statustext_encode(mavlink.MAV_SEVERITY_WARNING, b"Battery low")
        recorder.record("udpout:127.0.0.1:14550", 4.0, frame(codec, said))
    (path,) = tmp_path.glob("*.tlog")
    assert "Battery low" in told_by("mavlogdump.py", "--types", "STATUSTEXT", str(path))
    modes = told_by("mavflightmodes.py", str(path))
    assert modes.index("GUIDED") < modes.index("RTL")


def told_by(tool: str, *arguments: str) -> str:
    command = [sys.executable, str(Path(sys.executable).with_name(tool)), *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=60).stdout


def test_signatures_stay_out_and_the_frame_is_still_good() -> None:
    codec = sender(signed=True)
    signed = frame(codec, codec.attitude_encode(5, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0))
    clean = without_secrets(signed)
    assert clean is not None
    assert len(clean) == len(signed) - 13
    (read,) = mavlink.MAVLink(None).parse_buffer(clean)
    assert (read.get_type(), read.time_boot_ms, read.get_signed()) == ("ATTITUDE", 5, False)


def test_the_key_itself_is_never_recorded() -> None:
    codec = sender()
    assert without_secrets(frame(codec, codec.setup_signing_encode(1, 1, bytes(32), 1))) is None


def test_answers_are_matched_to_requests() -> None:
    meter = LatencyMeter()
    (stamp_ns,) = meter.requests_ns(10.0)
    assert meter.requests_ns(10.05) == ()
    meter.on_answer(123, 10.2)  # somebody else's
    assert meter.latency_s is None
    meter.on_answer(stamp_ns, 10.2)
    assert abs((meter.latency_s or 0.0) - 0.2) < 1e-6
    meter.on_answer(stamp_ns, 19.0)  # a duplicate
    assert abs((meter.latency_s or 0.0) - 0.2) < 1e-6


def test_a_link_that_loses_answers_is_asked_twice_a_time_but_not_one_that_never_answers() -> None:
    good, bad, mute = LatencyMeter(), LatencyMeter(), LatencyMeter()
    asked = []
    for tick in range(60):
        now_s = 10.0 + tick / 10
        (stamp_ns,) = good.requests_ns(now_s)
        good.on_answer(stamp_ns, now_s + 0.02)
        stamps = bad.requests_ns(now_s)
        asked.append(len(stamps))
        if tick % 2:  # every other answer gets lost
            bad.on_answer(stamps[0], now_s + 0.02)
        assert len(mute.requests_ns(now_s)) == 1
    assert asked[:10] == [1] * 10
    assert asked[-20:] == [2] * 20


def test_a_later_flight_into_the_same_folder_keeps_the_earlier_log(tmp_path: Path) -> None:
    codec = sender()
    for begun_s in (EPOCH_S, EPOCH_S, EPOCH_S + 3600.0):
        with TlogRecorder(tmp_path, begun_s) as recorder:
            recorder.record("udpout:127.0.0.1:14550", 0.0, frame(codec, codec.attitude_encode(0, 0, 0, 0, 0, 0, 0)))
    sizes = sorted(path.stat().st_size for path in tmp_path.glob("*.tlog"))
    assert len(sizes) == 2
    assert sizes[1] == 2 * sizes[0], "two that began in one second share a file"


def test_a_full_disk_ends_the_log_and_not_the_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    codec = sender()
    with TlogRecorder(tmp_path, EPOCH_S) as recorder, Path("/dev/full").open("wb", buffering=0) as full:
        monkeypatch.setattr(recorder, "_file", lambda address: full)
        for second in range(3):
            recorder.record("udpin:0.0.0.0:1", float(second), frame(codec, codec.system_time_encode(1, 1)))
        (told,) = recorder.take_troubles()
        assert "udpin:0.0.0.0:1" in told
        assert "No space left" in told
        assert recorder.take_troubles() == []


def test_a_folder_that_cannot_be_made_is_told_before_anything_flies(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LinkError, match="telemetry logs"):
        TlogRecorder(tmp_path / "file" / "logs", EPOCH_S)
