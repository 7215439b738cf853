"""Late packets are dropped, delays are seen, reboots are taken up."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcs.links.boot_clock import BootClock


def test_a_constant_delay_is_part_of_the_offset() -> None:
    clock = BootClock()
    assert clock.measured_s(5.0, 100.05) == pytest.approx(100.05)
    assert clock.measured_s(5.1, 100.15) == pytest.approx(100.15)


def test_a_packet_held_back_shows_its_age() -> None:
    clock = BootClock()
    clock.measured_s(5.0, 100.0)
    measured_s = clock.measured_s(6.0, 111.0)
    assert measured_s == pytest.approx(101.0, abs=0.01)


def test_a_latecomer_is_dropped() -> None:
    clock = BootClock()
    clock.measured_s(20.0, 100.0)
    assert clock.measured_s(19.9, 100.1) is None
    assert clock.measured_s(9.0, 100.2) is None
    assert clock.measured_s(20.2, 100.2) is not None
    assert clock.reboots == 0


def test_a_reboot_is_taken_up_after_a_few_messages() -> None:
    clock = BootClock()
    clock.measured_s(500.0, 1000.0)
    answers = [clock.measured_s(1.0 + 0.1 * k, 1010.0 + 0.1 * k) for k in range(6)]
    assert answers[0] is None
    assert answers[-1] == pytest.approx(1010.5)
    assert clock.reboots == 1


def aged_s(clock: BootClock, boot_s: float, now_s: float) -> float:
    measured_s = clock.measured_s(boot_s, now_s)
    assert measured_s is not None
    return now_s - measured_s


def test_a_clock_that_stood_still_is_believed_again_after_an_answer() -> None:
    """A simulator stood still for 4 s: its stamps are 4 s late for ever, and its answers show that it is they alone."""
    clock = BootClock()
    clock.measured_s(10.0, 100.0)
    assert aged_s(clock, 11.0, 105.0) == pytest.approx(4.0, abs=0.01)
    clock.answered(11.05, asked_s=105.0)
    assert aged_s(clock, 11.1, 105.1) == pytest.approx(0.05, abs=0.06)


@given(st.floats(0.0, 5.0), st.floats(0.0, 5.0), st.floats(0.0, 5.0), st.floats(-0.5, 0.5))
def test_no_answer_makes_a_place_younger_than_it_is(up_s: float, down_s: float, late_s: float, apart_s: float) -> None:
    """Whatever the delays of request, answer and place: with one clock the age is never told too small."""
    clock, boot_at_s = BootClock(), 90.0  # the vehicle's zero on our clock
    clock.measured_s(10.0, boot_at_s + 10.0 + late_s)
    told_s = 10.0 + 0.5 + apart_s
    clock.answered(told_s, asked_s=boot_at_s + told_s - up_s)
    assert clock.measured_s(11.0, boot_at_s + 11.0 + late_s + down_s) is not None
    assert clock._offset_s is not None
    drift_s = 1e-4 * (1.0 + down_s) + 1e-6
    assert clock._offset_s <= boot_at_s + late_s + drift_s, "no later than the least delay of a place allows"


def test_a_time_by_another_clock_is_no_proof() -> None:
    """Such as Unix time, or that of a companion which was started a minute later."""
    clock = BootClock()
    clock.measured_s(100.0, 500.0)
    for boot_s in (1.7e9, 40.0, 0.0, 102.0):
        clock.answered(boot_s, asked_s=600.0)
    assert aged_s(clock, 101.0, 510.0) == pytest.approx(9.0, abs=0.01)


def test_an_answer_before_the_first_stamp_says_nothing() -> None:
    clock = BootClock()
    clock.answered(5.0, asked_s=50.0)
    assert aged_s(clock, 6.0, 90.0) == pytest.approx(0.0)
