"""Late packets are dropped, delays are seen, reboots are taken up."""

import pytest

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
