"""Frames cut from a stream, against pymavlink's packing."""

from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v10 import common as v1
from pymavlink.dialects.v20 import common as v2

from gcs.links.frames import FrameCutter


def frames(signed: bool) -> list[bytes]:
    codec = v2.MAVLink(None, srcSystem=7, srcComponent=1)
    if signed:
        codec.signing.secret_key, codec.signing.sign_outgoing = bytes(range(32)), True
    old = v1.MAVLink(None, srcSystem=9, srcComponent=2)
    made = []
    for number in range(4):
        codec.seq = old.seq = number
        made.append(bytes(codec.attitude_encode(number, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0).pack(codec)))
        made.append(bytes(old.heartbeat_encode(2, 3, 0, 0, 4).pack(old)))
    return made


@given(st.lists(st.integers(1, 40), min_size=1, max_size=30), st.booleans(), st.binary(max_size=5))
def test_frames_come_out_whole_however_the_stream_is_cut(cuts: list[int], signed: bool, rubbish: bytes) -> None:
    rubbish = rubbish.replace(b"\xfe", b"x").replace(b"\xfd", b"x")
    sent = frames(signed)
    stream, cutter, got, at = rubbish + b"".join(sent), FrameCutter(), [], 0
    for cut in [*cuts, len(stream)]:
        got += cutter.feed(stream[at : at + cut])
        at += cut
    assert [frame.data for frame in got] == sent
    assert [(f.sequence, f.system_id, f.component_id, f.message_id) for f in got[:2]] == [(0, 7, 1, 30), (0, 9, 2, 0)]
