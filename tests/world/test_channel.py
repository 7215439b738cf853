"""Eq. 1-2 and Def. 1 against hand calculation."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policy.world.channel import (
    Radio,
    check_radio,
    coupling_loss_db,
    los_probability,
    path_loss_db,
    served,
    serving_radius_m,
)

PAPER = Radio()


def test_path_loss_by_hand() -> None:
    # 84.64 + 10 * 1.55 * log10(100) = 84.64 + 31
    assert path_loss_db(np.asarray(100.0), 84.64, 1.55) == pytest.approx(115.64)


def test_los_probability_by_hand() -> None:
    # exp(-0.005 * 0.5 * 200 * 0.4 / 118.7)
    expected = math.exp(-0.005 * 0.5 * 200.0 * 0.4 / 118.7)
    assert los_probability(np.asarray(200.0), 120.0, PAPER) == pytest.approx(expected)
    assert los_probability(np.asarray(0.0), 120.0, PAPER) == 1.0


def test_coupling_loss_straight_below() -> None:
    # line of sight is certain: 84.64 + 15.5 log10(120) - 5
    assert coupling_loss_db(np.asarray(0.0), 120.0, PAPER) == pytest.approx(84.64 + 15.5 * math.log10(120.0) - 5.0)


@pytest.mark.parametrize(("mcl_db", "radius_m"), [(115, 148), (117, 226), (119, 322), (121, 445), (123, 607)])
def test_serving_radius(mcl_db: float, radius_m: float) -> None:
    assert serving_radius_m(120.0, Radio(mcl_db=mcl_db)) == pytest.approx(radius_m, abs=0.5)


def test_no_radius_when_the_budget_is_too_small() -> None:
    assert serving_radius_m(120.0, Radio(mcl_db=90.0)) == 0.0


@given(st.floats(0.0, 5000.0), st.floats(0.0, 100.0))
def test_loss_grows_with_distance(distance_m: float, more_m: float) -> None:
    near, far = coupling_loss_db(np.asarray([distance_m, distance_m + more_m]), 120.0, PAPER)
    assert far >= near - 1e-9


def test_the_nearest_flying_uav_serves() -> None:
    distance_m = np.asarray([[100.0, 300.0, 225.0], [500.0, 210.0, 900.0]])
    assert served(distance_m, np.asarray([True, True]), 120.0, PAPER).tolist() == [True, True, True]
    assert served(distance_m, np.asarray([True, False]), 120.0, PAPER).tolist() == [True, False, True]
    assert not served(distance_m, np.asarray([False, False]), 120.0, PAPER).any()


def test_radios_without_a_radius_are_refused() -> None:
    with pytest.raises(ValueError, match="altitude_m"):
        check_radio(1.0, PAPER)
    with pytest.raises(ValueError, match="NLoS"):
        check_radio(120.0, Radio(alpha_nlos_db=50.0))
    with pytest.raises(ValueError, match="beta"):
        check_radio(120.0, Radio(beta_los=-1.0))
    check_radio(120.0, PAPER)
