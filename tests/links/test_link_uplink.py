"""What a vehicle got of ours, by its own clock: silences between the requests that it answered."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from gcs.links.uplink import WORTH_TELLING_S, UplinkMeter
from gcs.ports import Silence

OFFSET_S = 5000.0  # the vehicle's clock less ours


def meter(*answers: tuple[float, float]) -> UplinkMeter:
    made = UplinkMeter()
    for asked_s, got_s in answers:
        made.on_answer(OFFSET_S + got_s, asked_s)
    return made


def rounded(made: UplinkMeter) -> list[Silence]:
    return [Silence(round(silence.length_s, 6), silence.ended_s) for silence in made.silences]


def test_a_cut_is_as_long_as_the_vehicle_found_it_whatever_the_delays() -> None:
    """Asked at 1.0 and 2.2, got at 1.25 and 2.3: 1.05 s, though the answers may have come 0.6 s apart."""
    made = meter((0.9, 1.15), (1.0, 1.25), (2.2, 2.3), (2.3, 2.4))
    assert rounded(made) == [Silence(1.05, 2.2)]
    assert made.reached_s == 2.3


def test_an_answer_that_comes_late_fills_what_looked_like_a_cut() -> None:
    made = meter((1.0, 1.1), (2.2, 2.3))
    assert rounded(made) == [Silence(1.2, 2.2)]
    made.on_answer(OFFSET_S + 1.6, 1.5)
    assert rounded(made) == [Silence(0.5, 1.5), Silence(0.7, 2.2)]
    made.on_answer(OFFSET_S + 1.9, 1.8)
    assert rounded(made) == [Silence(0.5, 1.5), Silence(0.4, 2.2)]
    assert made.reached_s == 2.2


def test_it_forgets_after_a_while_and_when_the_vehicle_begins_anew() -> None:
    made = meter((1.0, 1.0), (3.0, 3.0))
    for tenth in range(31, 135):
        made.on_answer(OFFSET_S + tenth / 10, tenth / 10)
    assert made.silences == ()
    made = meter((1.0, 1.0), (3.0, 3.0))
    made.on_answer(0.5, 3.1)
    assert made.silences == ()
    assert made.reached_s == 3.1


def test_an_answer_held_back_for_seconds_is_neither_a_reboot_nor_a_cut() -> None:
    """By a router, say: taken for a reboot it would leave a gap of seconds before the next answer."""
    made = meter(*((tenth / 10, tenth / 10) for tenth in range(10, 61) if tenth != 15))
    made.on_answer(OFFSET_S + 1.5, 1.5)  # 4.5 s late
    made.on_answer(OFFSET_S + 6.1, 6.1)
    assert made.silences == ()
    assert made.reached_s == 6.1


@given(st.lists(st.integers(0, 23), min_size=2, unique=True))
def test_the_order_of_the_answers_does_not_matter(eighths: list[int]) -> None:
    """Within three seconds: more reads as a new beginning. Eighths of a second are exact numbers."""
    times_s = [eighth / 8 for eighth in eighths]
    shuffled, ordered = meter(*zip(times_s, times_s, strict=True)), meter(*((at_s, at_s) for at_s in sorted(times_s)))
    assert shuffled.silences == ordered.silences
    gaps_s = [after - before for before, after in pairwise(sorted(times_s))]
    assert [silence.length_s for silence in ordered.silences] == [gap_s for gap_s in gaps_s if gap_s >= WORTH_TELLING_S]
