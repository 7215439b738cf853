"""The forecast as it is learned: the score against numerical integration, examples by hand, torch against NumPy."""

from pathlib import Path

import numpy as np
import pytest
import torch

from policy.model.forecast import FORECAST_SLOTS, Forecaster
from policy.model.forecast_features import FORECAST_FEATURES, HISTORY_SLOTS
from policy.model.forecast_file import load_forecaster
from policy.training.forecast import save_forecast, train_forecast
from policy.training.forecast_data import FARTHEST_M, Examples, examples, walker_examples
from policy.training.forecast_network import ForecastNetwork, ranked_score
from policy.training.settings import TrainingError

WALK_M = 19.5


@pytest.fixture(autouse=True, scope="module")
def one_thread() -> None:
    """Small matrices on a busy machine: threads that wait for each other cost more than they bring."""
    torch.set_num_threads(1)


@pytest.mark.parametrize(("place", "blur", "truth"), [(0.0, 1.0, 0.3), (2.0, 0.5, -1.0), (1.0, 3.0, 7.5)])
def test_the_score_is_the_squared_error_of_the_chance(place: float, blur: float, truth: float) -> None:
    """Along one line (the truth lies on it, so bearings across it see the middle of an even chance)."""
    d = np.linspace(-60.0, 60.0, 400_001)
    expected = []
    for share in (1.0, np.sqrt(0.5), 0.0, -np.sqrt(0.5)):
        chance = np.clip((d - share * place + blur) / (2.0 * blur), 0.0, 1.0)
        expected.append(np.trapezoid((chance - (d >= share * truth)) ** 2, d))
    way, true_way = torch.tensor([[[place, 0.0]]]), torch.tensor([[[truth, 0.0]]])
    score = ranked_score(way, torch.tensor([[blur]]), true_way).item()
    assert score == pytest.approx(np.mean(expected), abs=2e-3)


def test_examples_are_what_was_seen_and_where_they_went() -> None:
    """One user walks 10 m north a slot, another stands 40 m east of the start, one jumps out of sight."""
    slots = HISTORY_SLOTS + FORECAST_SLOTS + 1
    pos_enu_m = np.zeros((slots, 3, 2))
    pos_enu_m[:, 0, 1] = 10.0 * np.arange(slots)
    pos_enu_m[:, 1, 0] = 40.0
    pos_enu_m[HISTORY_SLOTS + 1 :, 2] = [3000.0, 4000.0]
    seen = examples(pos_enu_m, 15.0, np.array([HISTORY_SLOTS]))
    assert seen.features.shape == (3, FORECAST_FEATURES)
    np.testing.assert_allclose(seen.way[0, :, 0], 10.0 * np.arange(1, FORECAST_SLOTS + 1) / WALK_M, rtol=1e-5)
    np.testing.assert_allclose(seen.way[0, :, 1], 0.0, atol=1e-6)
    assert not seen.way[1].any()
    np.testing.assert_allclose(np.linalg.norm(seen.way[2], axis=-1), FARTHEST_M / WALK_M, rtol=1e-5)
    early = examples(pos_enu_m, 15.0, np.array([0, 1]))
    along = early.features.reshape(2, 3, -1)[:, 0]
    assert not along[0, : 3 * HISTORY_SLOTS].any()
    np.testing.assert_allclose(along[1, :2], [np.arcsinh(10.0 / WALK_M), 0.0], atol=1e-6)


def test_walkers_differ_and_repeat() -> None:
    one, other = (list(walker_examples(2, seed=3)) for _ in range(2))
    assert all(np.array_equal(a.features, b.features) for a, b in zip(one, other, strict=True))
    assert one[0].features.shape != one[1].features.shape


def made_examples(seed: int) -> Examples:
    """Everybody goes on as before; half of them unsteadily."""
    rng = np.random.default_rng(seed)
    unsteady = np.where(np.arange(40) % 2, 0.2, 12.0)[:, None]
    pos_enu_m = np.cumsum(np.array([12.0, 0.0]) + unsteady * rng.normal(size=(60, 40, 2)), axis=0)
    return examples(pos_enu_m, 15.0, np.arange(10, 40))


def test_it_learns_ways_and_doubt_and_numpy_runs_it(tmp_path: Path) -> None:
    seen = made_examples(1)
    told: list[tuple[int, float]] = []
    network = train_forecast([seen], updates=400, seed=2, tell=lambda update, score: told.append((update, score)))
    assert [update for update, _ in told] == list(range(1, 401))
    assert np.mean([score for _, score in told[-20:]]) < 0.3 * told[0][1]
    path = tmp_path / "f.safetensors"
    save_forecast(network, path, data="made", updates=400, seed=2, seconds=1.0)
    fresh = made_examples(7)
    ways, blurs = load_forecaster(path).outputs(fresh.features)
    with torch.no_grad():
        torch_ways, torch_blurs = network(torch.from_numpy(fresh.features))
    np.testing.assert_allclose(ways, torch_ways.numpy(), atol=1e-4)
    np.testing.assert_allclose(blurs, torch_blurs.numpy(), atol=1e-4)
    steady = np.arange(len(blurs)) % 2 == 1
    assert blurs[~steady].mean() > 2.0 * blurs[steady].mean()


def test_the_same_seed_gives_the_same_weights_and_real_sets_are_half_of_it() -> None:
    parts = [made_examples(1)]
    one, other = (train_forecast(parts, parts, updates=5, seed=4).state_dict() for _ in range(2))
    assert all(torch.equal(one[name], other[name]) for name in one)


def test_places_that_are_none_stop_it() -> None:
    seen = made_examples(1)
    with pytest.raises(TrainingError, match="not finite"):
        train_forecast([Examples(seen.features, np.full_like(seen.way, np.nan))], updates=3, seed=0)


def test_at_the_start_everybody_stays() -> None:
    network = ForecastNetwork(torch.zeros(FORECAST_FEATURES), torch.ones(FORECAST_FEATURES))
    ways, blurs = network(torch.randn(5, FORECAST_FEATURES))
    assert not ways.any()
    torch.testing.assert_close(blurs, torch.full_like(blurs, float(blurs[0, 0].detach())))
    numpy_ways, _ = Forecaster({n: t.detach().numpy() for n, t in network.state_dict().items()}).outputs(
        np.ones((2, FORECAST_FEATURES), dtype=np.float32)
    )
    assert numpy_ways.shape == (2, FORECAST_SLOTS, 2)
