"""Whatever comes in, the reader answers with a mission or with one clear line."""

import tomllib
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from policy.mission_file import Mission, MissionError, parse_mission, parse_mission_text

VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**400), 10**400)
    | st.floats()
    | st.text(max_size=20)
    | st.text(st.characters(categories=["Cs"]), max_size=2)
    | st.dates(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=10,
)


def outcome(read: Callable[[], Mission]) -> None:
    """A mission, or one line; any other exception fails the test."""
    complaint = None
    try:
        read()
    except MissionError as error:
        complaint = str(error)
    assert complaint is None or (complaint.strip() and "\n" not in complaint)


@given(st.text(max_size=300))
def test_any_text(text):
    outcome(lambda: parse_mission_text(text))


@given(st.dictionaries(st.text(max_size=10), VALUES, max_size=5))
def test_any_object(document):
    outcome(lambda: parse_mission(document))


@given(VALUES)
def test_anything_at_all(document):
    outcome(lambda: parse_mission(document))


def places(document: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Every path into a document."""
    inner = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    return [path, *(found for key, value in inner for found in places(value, (*path, key)))]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=300)
@given(data=st.data())
def test_a_good_document_with_one_part_replaced(good, data):
    document = tomllib.loads(good)
    *way, last = data.draw(st.sampled_from(places(document)[1:]))
    target: Any = document
    for key in way:
        target = target[key]
    target[last] = data.draw(VALUES)
    outcome(lambda: parse_mission(document))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_good_text_with_a_piece_cut_out_or_put_in(good, data):
    start = data.draw(st.integers(0, len(good)))
    end = data.draw(st.integers(start, min(len(good), start + 30)))
    outcome(lambda: parse_mission_text(good[:start] + data.draw(st.text(max_size=5)) + good[end:]))


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 100_000, "a = " + "9" * 5000, "a = 0x" + "f" * 5000, "[campaign]\nslots = 0x" + "f" * 5000]
)
def test_extremes(text):
    with pytest.raises(MissionError):
        parse_mission_text(text)
