import pytest

from policy.training.settings import TrainSettings


def test_exploration_and_rate_fall_to_their_ends() -> None:
    settings = TrainSettings(episodes=11)
    assert settings.exploration(0) == settings.explore_start
    assert settings.exploration(10) == pytest.approx(settings.explore_end)
    assert settings.rate(0) == settings.learning_rate
    assert settings.rate(10) == pytest.approx(0.1 * settings.learning_rate)
    assert settings.rate(5) == pytest.approx(0.55 * settings.learning_rate)


@pytest.mark.parametrize(
    "change",
    [
        {"episodes": 0},
        {"beam": 0},
        {"search_depth": 0},
        {"search_depth": 6},
        {"explore_end": 0.5},
        {"learning_rate": 0.0},
        {"learning_rate": float("nan")},
        {"seed": -1},
        {"final_learning_rate_share": 0.0},
    ],
)
def test_what_cannot_be_run_is_refused(change: dict[str, float]) -> None:
    with pytest.raises(ValueError):
        TrainSettings(**change)
