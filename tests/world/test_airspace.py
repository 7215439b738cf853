"""Legal moves keep every later slot flyable: braking is always possible."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenarios import TOWER, make_scenario

from policy.world.actions import make_actions, paper_actions
from policy.world.airspace import hits_obstacle, inside_area, legal_moves
from policy.world.motion import slot_path_m


def test_a_move_beyond_the_edge_is_illegal() -> None:
    scenario = make_scenario()
    moves = paper_actions(18.0).vel_enu_mps
    legal = legal_moves(np.asarray([800.0, 1000.0]), np.zeros(2), moves, scenario)
    # 270 m north leaves the area of 1200 m; the diagonals go 191 m and stay.
    assert legal.tolist() == [True, False, True, True, True, True, True, True, True]


def test_room_to_brake_is_kept() -> None:
    # 270 m from standing at 4.5 m/s^2 is 234 m: it ends at 1190 m with 18 m/s, 36 m are needed to stop.
    scenario = make_scenario(accel=4.5)
    north = np.asarray([0.0, 18.0])
    assert not legal_moves(np.asarray([800.0, 956.0]), np.zeros(2), north, scenario)
    assert legal_moves(np.asarray([800.0, 929.0]), np.zeros(2), north, scenario)


def test_a_wall_between_start_and_end_blocks() -> None:
    scenario = make_scenario(obstacles=(TOWER,))
    east = np.asarray([18.0, 0.0])
    assert not legal_moves(np.asarray([800.0, 600.0]), np.zeros(2), east, scenario)
    assert legal_moves(np.asarray([800.0, 900.0]), np.zeros(2), east, scenario)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([math.inf, 4.5, 2.5]))
def test_legal_moves_never_lead_into_a_corner(seed: int, accel: float) -> None:
    rng = np.random.default_rng(seed)
    scenario = make_scenario(obstacles=(TOWER,), accel=accel)
    moves = make_actions(8, (9.0, 18.0)).vel_enu_mps
    position, velocity = np.asarray([800.0, 600.0]), np.zeros(2)
    for _ in range(25):
        legal = np.flatnonzero(legal_moves(position, velocity, moves, scenario))
        assert legal.size > 0
        choice = moves[rng.choice(legal)]
        path, _ = slot_path_m(position, velocity, choice, accel, scenario.slot_s)
        assert inside_area(path, scenario).all()
        assert not hits_obstacle(path, scenario).any()
        position, velocity = path[-1], choice


@pytest.mark.parametrize("bad", [(0, (18.0,)), (8, ()), (8, (0.0,))])
def test_bad_action_sets_are_refused(bad: tuple[int, tuple[float, ...]]) -> None:
    with pytest.raises(ValueError, match="positive"):
        make_actions(*bad)
