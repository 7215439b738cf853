"""Results as tables in two lines."""

import json
from pathlib import Path

import pytest

from policy.__main__ import main
from policy.evaluation import TableError, load_table

RESULTS = Path(__file__).parents[2] / "docs" / "results"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What two commands wrote."""
    place = tmp_path_factory.mktemp("results")
    common = ["evaluate", "demo", "--policy", "random", "--slots", "3"]
    assert main([*common, "--json", str(place / "one.json"), "--trajectory", str(place / "way.csv")]) == 0
    assert main([*common, "--seeds", "3", "--json", str(place / "three.json")]) == 0
    return place


def test_a_result_is_a_row_a_seed(folder: Path) -> None:
    table = load_table(folder / "three.json")
    assert list(table["seed"]) == [0, 1, 2]
    document = json.loads((folder / "three.json").read_text())
    assert list(table["episodic_aoi"]) == document["episodic_aoi"]["values"]
    assert table["episodic_aoi"].mean() == pytest.approx(document["episodic_aoi"]["mean"])
    assert set(table["violations_geofence"]) == {0}


def test_several_files_stand_below_each_other(folder: Path) -> None:
    table = load_table(folder / "one.json", folder / "three.json")
    assert (len(table), table["file"].nunique()) == (4, 2)
    assert list(table.index) == [0, 1, 2, 3]


def test_a_trajectory_is_a_row_each(folder: Path) -> None:
    table = load_table(folder / "way.csv")
    assert dict(table.groupby("kind")["id"].nunique()) == {"uav": 2, "user": 60}
    assert table[table["kind"] == "user"].query("slot > 0")["aoi"].mean() == pytest.approx(
        load_table(folder / "one.json")["episodic_aoi"][0]
    )


def test_the_shipped_results_load() -> None:
    table = load_table(RESULTS)
    assert {"purdue", "ncsu", "kaist"} <= set(table["campus"])


@pytest.mark.parametrize("text", ["[]", "{}", "nonsense", '{"policy": "random"}', '{"episodic_aoi": {"mean": 1}}'])
def test_other_files_are_refused_in_one_line(text: str, tmp_path: Path) -> None:
    file = tmp_path / "other.json"
    file.write_text(text)
    with pytest.raises(TableError, match=r"other\.json: holds no results"):
        load_table(file)


def test_what_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TableError, match="cannot be read"):
        load_table(tmp_path / "gone.json")
    with pytest.raises(TableError, match="no campaigns"):
        load_table(tmp_path)
    with pytest.raises(TableError, match="at least one"):
        load_table()
