"""What a bad link does to datagrams."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from sitl_mock.link import MEAN_BURST_S, REORDER_S, Link


def _link(seed: int = 3, **quality: float) -> Link:
    link = Link(np.random.default_rng(seed))
    for name, value in quality.items():
        setattr(link.quality, name, value)
    return link


def test_burst_loss_loses_its_share_in_long_spells() -> None:
    link = _link(burst_loss=0.25)
    arrived = []
    for number in range(100_000):
        link.put(1, b"x", number * 0.02)
        arrived.append(bool(link.take(number * 0.02)))
    lost = 1.0 - sum(arrived) / len(arrived)
    changes = sum(a != b for a, b in pairwise(arrived))
    assert lost == pytest.approx(0.25, abs=0.03)
    mean_spell_s = 2 * lost * len(arrived) * 0.02 / changes
    assert mean_spell_s == pytest.approx(MEAN_BURST_S, rel=0.15)


def test_corruption_changes_bytes_and_keeps_the_length() -> None:
    link = _link(corrupt=1.0)
    whole = bytes(range(200))
    for _ in range(50):
        link.put(1, whole, 0.0)
    got = [data for _, data in link.take(0.0)]
    assert len(got) == 50
    assert all(len(data) == 200 and 1 <= sum(a != b for a, b in zip(data, whole, strict=True)) <= 4 for data in got)


def test_reordering_lets_later_ones_pass() -> None:
    link = _link(reorder=0.3)
    order = []
    for number in range(500):
        link.put(1, number.to_bytes(2, "big"), number * 0.02)
        order += [int.from_bytes(data, "big") for _, data in link.take(number * 0.02)]
    order += [int.from_bytes(data, "big") for _, data in link.take(1e3)]
    assert sorted(order) == list(range(500))
    assert order != list(range(500))
    assert max(abs(place - number) for place, number in enumerate(order)) <= REORDER_S / 0.02 + 1


def test_all_or_nothing_shares() -> None:
    for share, expected in ((1.0, 0), (0.0, 100)):
        link = _link(burst_loss=share, seed=1)
        for number in range(100):
            link.put(1, b"x", number * 0.1)
        assert len(link.take(1e3)) == pytest.approx(expected, abs=1)
