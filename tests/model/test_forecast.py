"""Users' places ahead: bearings cancel out, the absent count for nothing, files that do not fit are refused."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from policy.model.checkpoint import load_evaluator
from policy.model.checkpoint_error import CheckpointError
from policy.model.evaluator import NetworkEvaluator
from policy.model.files import sha256
from policy.model.forecast import FORECAST_SLOTS, Forecaster, UserForecast
from policy.model.forecast_features import (
    CROWD_M,
    FAINT,
    FORECAST_FEATURES,
    HISTORY_SLOTS,
    Seen,
    forecast_features,
    turned,
    turned_back,
)
from policy.model.forecast_file import DEFAULT_FORECAST, load_forecaster
from policy.model.history import StepHistory
from policy.world.arrays import FloatArray
from policy.world.scenario import Area, Scenario
from policy.world.state import WorldState, initial_state

USERS = 6
SCENARIO = Scenario(Area((0.0, 0.0), (2000.0, 2000.0)), np.zeros((1, 2)), np.full(USERS, 0.02))
FLOAT32 = (
    1e-5  # relative: the crowd is counted in single precision, and sums over another number of users round otherwise
)
WALK_M = 19.5


def random_forecaster(seed: int = 0, width: int = 5) -> Forecaster:
    rng = np.random.default_rng(seed)
    outs = 3 * FORECAST_SLOTS
    shapes = {"first": (width, FORECAST_FEATURES), "second": (width, width), "out": (outs, width)}
    weights = {f"{name}.weight": 0.3 * rng.normal(size=shape) for name, shape in shapes.items()}
    weights |= {f"{name}.bias": 0.1 * rng.normal(size=shape[0]) for name, shape in shapes.items()}
    weights |= {"mean": np.zeros(FORECAST_FEATURES), "deviation": np.ones(FORECAST_FEATURES)}
    return Forecaster({name: array.astype(np.float32) for name, array in weights.items()})


def seen(pos_enu_m: FloatArray, away: tuple[int, ...] = ()) -> tuple[WorldState, StepHistory]:
    history = StepHistory(HISTORY_SLOTS)
    active = np.array([user not in away for user in range(pos_enu_m.shape[1])], dtype=np.bool_)
    for slot, place_m in enumerate(pos_enu_m):
        state = replace(initial_state(SCENARIO, place_m), slot=slot, user_active=active)
        history.see(state)
    return state, history


def walks(seed: int, users: int = USERS) -> FloatArray:
    rng = np.random.default_rng(seed)
    return rng.uniform(400.0, 1600.0, (users, 2)) + np.cumsum(rng.normal(0.0, 15.0, (10, users, 2)), axis=0)


def test_there_and_back() -> None:
    rng = np.random.default_rng(0)
    vector, angle = rng.normal(size=(7, 2)), rng.uniform(0.0, 6.0, 7)
    bearing = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    np.testing.assert_allclose(turned_back(turned(vector, bearing), bearing), vector)
    np.testing.assert_allclose(turned(bearing, bearing), np.broadcast_to([1.0, 0.0], (7, 2)), atol=1e-12)


@pytest.mark.parametrize("degrees", [90.0, 201.0])
def test_a_campus_turned_round_is_forecast_turned_round(degrees: float) -> None:
    forecaster, pos_enu_m = random_forecaster(), walks(1)
    turn = math.radians(degrees)
    rotation = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    one = forecaster.forecast(*seen(pos_enu_m), WALK_M)
    other = forecaster.forecast(*seen(pos_enu_m @ rotation), WALK_M)
    np.testing.assert_allclose(other.pos_enu_m, one.pos_enu_m @ rotation, atol=1e-2)
    np.testing.assert_allclose(other.blur_m, one.blur_m, atol=1e-3)


def test_the_absent_stay_and_nobody_looks_at_them() -> None:
    forecaster, pos_enu_m = random_forecaster(), walks(2)
    gone = forecaster.forecast(*seen(pos_enu_m, away=(USERS - 1,)), WALK_M)
    never = forecaster.forecast(*seen(pos_enu_m[:, :-1]), WALK_M)
    np.testing.assert_allclose(gone.pos_enu_m[:, :-1], never.pos_enu_m, rtol=FLOAT32)
    np.testing.assert_allclose(gone.blur_m[:, :-1], never.blur_m, rtol=FLOAT32)
    np.testing.assert_array_equal(gone.pos_enu_m[:, -1], np.broadcast_to(pos_enu_m[-1, -1], (FORECAST_SLOTS, 2)))
    assert not gone.blur_m[:, -1].any()


def test_of_nobody_nothing_is_forecast() -> None:
    ahead = random_forecaster().forecast(*seen(np.zeros((3, 0, 2))), WALK_M)
    assert ahead.pos_enu_m.shape == (FORECAST_SLOTS, 0, 2)
    assert ahead.blur_m.shape == (FORECAST_SLOTS, 0)


def test_the_crowd_is_counted_as_by_hand() -> None:
    """One user's neighbours, some of them absent, by a loop over them."""
    rng = np.random.default_rng(5)
    pos_enu_m, active = rng.uniform(0.0, 400.0, (1, 7, 2)), np.array([[True, True, False, True, True, False, True]])
    steps_m, known = np.zeros((1, 7, HISTORY_SLOTS, 2)), np.zeros((1, 7), dtype=np.int64)
    features, _ = forecast_features(Seen(pos_enu_m, steps_m, known, active), WALK_M)
    told = features[0, 3, -3 * len(CROWD_M) :].reshape(-1, 3)
    ways_m = [place_m - pos_enu_m[0, 3] for user, place_m in enumerate(pos_enu_m[0]) if active[0, user] and user != 3]
    for reach_m, (east, north, count) in zip(CROWD_M, told, strict=True):
        bells = [math.exp(-0.5 * float(way_m @ way_m) / reach_m**2) for way_m in ways_m]
        pull = sum(bell * way_m for bell, way_m in zip(bells, ways_m, strict=True)) / (sum(bells) + FAINT) / reach_m
        np.testing.assert_allclose((east, north, count), (*pull, math.log1p(sum(bells))), rtol=1e-4)


def test_beyond_its_reach_the_last_slot_is_repeated() -> None:
    whole = UserForecast(np.arange(6.0).reshape(3, 1, 2), np.arange(3.0)[:, None])
    assert whole.up_to(2).blur_m.tolist() == [[0.0], [1.0]]
    assert whole.up_to(5).blur_m.tolist() == [[0.0], [1.0], [2.0], [2.0], [2.0]]


def test_the_shipped_forecast_lets_who_stands_stand_and_who_walks_walk() -> None:
    """Straight for two minutes at walking speed, beside five who never moved."""
    pos_enu_m = np.repeat(walks(3)[:1], 10, axis=0)
    pos_enu_m[:, 0, 0] = 300.0 + WALK_M * np.arange(10)
    ahead = load_forecaster().forecast(*seen(pos_enu_m), WALK_M)
    way_m = ahead.pos_enu_m - pos_enu_m[-1]
    assert np.abs(way_m[0, 1:]).max() < 5.0
    assert 0.5 * WALK_M < way_m[0, 0, 0] < 1.5 * WALK_M
    assert abs(way_m[0, 0, 1]) < 5.0
    assert np.all(ahead.blur_m > 0.0)
    assert ahead.blur_m[14, 0] > 2.0 * ahead.blur_m[0, 0]
    assert ahead.blur_m[:, 0].mean() > 3.0 * ahead.blur_m[:, 1:].mean()


def test_a_forecast_that_does_not_fit_is_refused_in_one_line(tmp_path: Path) -> None:
    path, card = tmp_path / "f.safetensors", tmp_path / "f.json"
    arrays = load_file(DEFAULT_FORECAST)

    def refusal() -> str:
        with pytest.raises(CheckpointError) as refused:
            load_forecaster(path)
        assert "\n" not in str(refused.value)
        return str(refused.value)

    assert "no such forecast" in refusal()
    path.write_bytes(b"{}")
    assert "cannot" not in refusal()
    save_file({**arrays, "out.bias": np.zeros(4, dtype=np.float32)}, path)
    assert "train again" in refusal()
    save_file(arrays, path)
    assert "model card" in refusal()
    card.write_text("[]")
    assert "not a model card" in refusal()
    card.write_text(json.dumps({"sha256": "0" * 64}))
    assert "sha256" in refusal()
    card.write_text(json.dumps({"sha256": sha256(path)}))
    assert load_forecaster(path) is not None


def test_an_evaluator_without_one_says_so() -> None:
    state, history = seen(walks(4))
    units = type("U", (), {"walk_m": WALK_M})()
    runner = type("R", (), {"spec": None})()
    with pytest.raises(ValueError, match="use_forecast=False"):
        NetworkEvaluator(runner).forecast_users(state, history, units)
    assert load_evaluator().forecast_users(state, history, units).blur_m.shape == (FORECAST_SLOTS, USERS)
