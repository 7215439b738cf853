"""The curve that training keeps, against what TensorBoard was told, and across interruptions."""

from pathlib import Path

import pytest
from tests_training_small import SMALL_PLACE, SMALL_RUN, small_scenario

from policy.evaluation.learning_curve import CURVE, read_curve
from policy.training.api import train
from policy.training.curve import main
from policy.training.settings import TrainingError, TrainProgress


class Pulled(Exception):
    """The plug."""


def pull_after(episodes: int):  # type: ignore[no-untyped-def]
    def told(progress: TrainProgress) -> None:
        if progress.episode > episodes:
            raise Pulled

    return told


def test_an_interrupted_run_keeps_the_same_curve_and_the_logs_tell_it_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path / "whole")
    with pytest.raises(Pulled):
        train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path / "cut", progress=pull_after(2))
    assert [point.episode for point in read_curve(tmp_path / "cut" / CURVE) or ()] == [1, 2]
    cut = train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path / "cut", resume=True)
    kept = (whole / CURVE).read_text()
    assert (cut / CURVE).read_text() == kept

    for folder in (whole, cut):
        (folder / CURVE).unlink()
        assert main([str(folder)]) == 0
        written, first = (read_curve(folder / CURVE), kept.splitlines()[1])
        assert written is not None
        assert [point.episode for point in written] == [1, 2, 3, 4]
        assert written[0].score == pytest.approx(float(first.split(",")[1]), rel=1e-6)
        assert written[0].prediction_loss == pytest.approx(float(first.split(",")[4]), rel=1e-6)
    assert str(whole / CURVE) in capsys.readouterr().out


def test_a_damaged_curve_stops_a_resumption_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(Pulled):
        train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path, progress=pull_after(2))
    (tmp_path / CURVE).write_text("half of")
    with pytest.raises(TrainingError, match="not a learning curve"):
        train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path, resume=True)


def test_a_folder_without_logs_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
