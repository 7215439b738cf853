"""Frames are packed byte for byte as pymavlink packs them."""

import struct
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from gcs.links.frame_writer import frame_of
from gcs.links.kinds import BY_NAME
from gcs.links.wire import OWN_COMPONENT_ID, OWN_SYSTEM_ID

FLOATS = st.floats(width=32)
RANGES = {"b": 8, "h": 16, "i": 32, "q": 64, "B": 8, "H": 16, "I": 32, "Q": 64}


def codec(key: bytes | None = None) -> Any:
    made = mav.MAVLink(None, srcSystem=OWN_SYSTEM_ID, srcComponent=OWN_COMPONENT_ID)
    if key is not None:
        made.signing.secret_key, made.signing.sign_outgoing, made.signing.timestamp = key, True, 10**12
    return made


def values_of(code: str) -> st.SearchStrategy[Any]:
    if code in "fd":
        return FLOATS | st.just(0.0)
    bits = RANGES[code]
    low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if code.islower() else (0, 2**bits - 1)
    return st.integers(low, high) | st.just(0)


@st.composite
def messages(draw: st.DrawFn) -> tuple[str, dict[str, Any]]:
    """Any message of numbers; extensions given or left out."""
    kind = BY_NAME[draw(st.sampled_from(sorted(name for name, kind in BY_NAME.items() if kind.is_plain)))]
    codes = dict(zip(kind.fields, kind.struct.format.lstrip("<"), strict=True))
    names = [name for name in kind.fields if name not in kind.defaults or draw(st.booleans())]
    return kind.name, {name: draw(values_of(codes[name])) for name in names}


@settings(max_examples=150, deadline=None)
@given(messages(), st.integers(0, 255), st.booleans())
def test_any_message_of_numbers(message: tuple[str, dict[str, Any]], sequence: int, has_key: bool) -> None:
    name, fields = message
    ours, theirs = (codec(bytes(range(32)) if has_key else None) for _ in range(2))
    ours.seq = theirs.seq = sequence
    assert frame_of(name, fields, ours) == bytes(BY_NAME[name].kind(**fields).pack(theirs))
    assert ours.seq == (sequence + 1) % 256
    assert ours.signing.timestamp == theirs.signing.timestamp


def test_texts_and_arrays() -> None:
    fields = {"target_system": 1, "target_component": 1, "param_id": b"WPNAV_SPEED", "param_index": -1}
    assert frame_of("PARAM_REQUEST_READ", fields, codec()) == bytes(
        mav.MAVLink_param_request_read_message(1, 1, b"WPNAV_SPEED", -1).pack(codec())
    )


@pytest.mark.parametrize(
    ("fields", "words"), [({"tc1": 1}, "ts1"), ({"tc1": 1, "ts1": 2, "tc2": 3}, "tc2"), ({}, "tc1, ts1")]
)
def test_a_field_that_is_missing_or_unknown_is_a_defect(fields: dict[str, Any], words: str) -> None:
    own = codec()
    with pytest.raises(TypeError, match=words):
        frame_of("TIMESYNC", fields, own)
    assert own.seq == 0, "nothing was sent, so no number is missing"


def test_a_value_that_does_not_fit_is_a_defect() -> None:
    with pytest.raises(struct.error):
        frame_of("TIMESYNC", {"tc1": 2**63, "ts1": 0}, codec())
