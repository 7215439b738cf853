"""The battery pack by hand."""

from __future__ import annotations

import pytest

from sitl_mock.battery import Pack
from sitl_mock.physics.vehicle import M600


def test_full_and_empty_at_rest() -> None:
    pack = Pack(M600, 25.0)
    assert pack.measure(0.0, 0.0).voltage_v == pytest.approx(6 * 4.2)
    assert pack.measure(359_640.0, 0.0).voltage_v == pytest.approx(6 * 3.3)
    assert pack.measure(359_640.0, 0.0).remaining == 0.0
    assert pack.measure(179_820.0, 0.0).used_mah == pytest.approx(2250.0)


def test_load_sags_by_ohms_law_at_once_and_further_with_time() -> None:
    pack = Pack(M600, 25.0)
    at_once = pack.measure(0.0, 222.0)  # 10 A
    assert at_once.current_a == pytest.approx(10.0)
    assert at_once.voltage_v == pytest.approx(25.2 - 6 * 0.004 * 10.0)
    for _ in range(3000):
        pack.advance(222.0, 0.1)
    assert pack.measure(0.0, 222.0).voltage_v < at_once.voltage_v - 6 * 0.0025 * 10.0


def test_cold_sags_more_and_load_warms() -> None:
    cold, warm = Pack(M600, -10.0), Pack(M600, 30.0)
    assert cold.measure(0.0, 400.0).voltage_v < warm.measure(0.0, 400.0).voltage_v - 0.5
    before = cold.temperature_c
    for _ in range(6000):
        cold.advance(400.0, 0.1)
    assert before + 1.0 < cold.temperature_c < before + 60.0


def test_a_failed_cell_is_seen() -> None:
    pack = Pack(M600, 25.0)
    pack.failed_cells = 1
    measured = pack.measure(0.0, 0.0)
    assert measured.cell_v == pytest.approx((4.2,) * 5 + (2.0,))
    assert measured.voltage_v == pytest.approx(23.0)
