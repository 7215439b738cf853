"""A curve survives writing and reading; what is none is refused; the shipped ones belong to their checkpoints."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from policy.evaluation.learning_curve import COLUMNS, CurvePoint, curve_file, curve_text, read_curve
from policy.model.checkpoint_error import CheckpointError
from policy.model.files import SHIPPED

NUMBER = st.floats(1e-6, 1e6)
POINTS = st.lists(st.builds(CurvePoint, st.integers(1, 10**6), NUMBER, NUMBER, NUMBER, NUMBER), max_size=5)


@given(POINTS)
def test_written_and_read_again_it_stays_the_same(tmp_path_factory, points):
    path = tmp_path_factory.getbasetemp() / "again.csv"
    path.write_text(curve_text(points))
    again = read_curve(path)
    assert curve_text(again) == path.read_text()
    assert [p.episode for p in again] == [p.episode for p in points]
    assert [p.score for p in again] == pytest.approx([p.score for p in points], rel=1e-6)


@pytest.mark.parametrize(
    "text", ["", "a,b\n1,2\n", ",".join(COLUMNS) + "\n1,2\n", ",".join(COLUMNS) + "\none,2,3,4,5\n"]
)
def test_what_is_no_curve_is_refused_in_one_line(tmp_path, text):
    path = tmp_path / "curve.csv"
    path.write_text(text)
    with pytest.raises(CheckpointError, match="not a learning curve") as refusal:
        read_curve(path)
    assert "\n" not in str(refusal.value)
    assert str(path) in str(refusal.value)


def test_none_where_there_is_no_file(tmp_path):
    assert read_curve(curve_file(tmp_path)) is None


@pytest.mark.parametrize("card", sorted(SHIPPED.glob("gcrl-*.json")), ids=lambda path: path.stem)
def test_each_shipped_curve_is_of_its_checkpoint_s_training(card):
    told = json.loads(card.read_text())
    curve = read_curve(curve_file(card.with_suffix("")))
    assert [point.episode for point in curve] == list(range(1, told["episodes"] + 1))
    assert curve[-1].mean_score == pytest.approx(told["episodic_aoi_last_20"], rel=1e-6)
    scores = [point.score for point in curve]
    assert [sum(scores[n - 20 : n]) / 20 for n in range(20, told["episodes"] + 1)] == pytest.approx(
        [point.mean_score for point in curve[19:]], rel=1e-5
    )
