"""The page, the plots and the data: the same results give the same bytes, and what is missing is said."""

import csv

import pytest

from policy.agents.registry import POLICIES
from policy.evaluation.tables import plots
from policy.evaluation.tables.campuses import find_campus
from policy.evaluation.tables.cells import fly_task, make_task
from policy.evaluation.tables.grid import SECTIONS, Extent, make_grid
from policy.evaluation.tables.methods import Absent, Method
from policy.evaluation.tables.paper import CAMPUSES, TABLE_I, TABLE_II_MS, TABLE_III
from policy.evaluation.tables.provenance import Provenance
from policy.evaluation.tables.report import Findings, page, write_report
from policy.evaluation.tables.spread import spread

ORIGIN = Provenance("python -m policy tables", "2024-05-06T07:08:09+00:00", "a machine", "Python", "abc", "def")


@pytest.fixture
def found(tiny):
    """Random and what is missing, on a campus of our own."""
    campus = find_campus(str(tiny), 4)
    grid = make_grid(SECTIONS, [campus.name], Extent(2, uavs=(2, 3), mcl_db=(117.0, 119.0)), models=())
    cells = {}
    for point in grid.points():
        if point.method.policy == "random":
            cells[point] = [fly_task(make_task(campus, point, seed)) for seed in range(2)]
    timings = {campus.name: {"methods": {"random": {"mean": 0.5, "p50": 0.4, "p99": 0.9, "processor_p50": 0.3}}}}
    return Findings(grid, [campus], {"ncsu": Absent("its trace is not at hand")}, cells, timings, ORIGIN, quick=False)


def test_the_same_results_give_the_same_bytes(found, tmp_path):
    folders = [tmp_path / "one", tmp_path / "two"]
    for folder in folders:
        folder.mkdir()
    one, two = (write_report(folder, found) for folder in folders)
    assert [path.name for path in one] == [path.name for path in two]
    assert {"README.md", "campaigns.csv", "timing.csv", "uavs-tiny.svg", "mcl-tiny.png"} <= {p.name for p in one}
    for first, second in zip(one, two, strict=True):
        assert first.read_bytes() == second.read_bytes(), first.name


def test_the_page_has_our_figures_and_says_what_is_missing(found):
    text = page(found)
    point, cells = next((point, cells) for point, cells in found.cells.items() if not point.method.options)
    ours = spread(cells, "episodic_aoi")
    values = [cell["metrics"]["episodic_aoi"] for cell in cells]
    assert (ours.mean, ours.std) == pytest.approx((sum(values) / 2, abs(values[0] - values[1]) / 2))
    assert f"| random | – | {ours} |" in text
    assert "`gcrl` (no checkpoint of it is shipped with this version)" in text
    assert "`muzero`" in text
    assert "no network of it trained there is at hand" in text
    assert "- ncsu: not flown, its trace is not at hand" in text
    assert "| random | – | 0.400 | 0.500 | 0.900 | 0.300 |" in text
    assert "| receding-horizon | – | failed |" in text  # asked for, not there
    for line in ORIGIN.lines():
        assert line in text
    assert point.campus in text


def test_every_table_row_has_as_many_cells_as_its_head(found):
    blocks = [block.splitlines() for block in page(found).split("\n\n") if block.startswith("|")]
    assert len(blocks) == 8
    for block in blocks:
        assert len({line.count("|") for line in block}) == 1


def test_campaigns_csv_holds_every_cell(found, tmp_path):
    write_report(tmp_path, found)
    with (tmp_path / "campaigns.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(map(len, found.cells.values()))
    assert {row["key"] for row in rows} == {cell["key"] for cells in found.cells.values() for cell in cells}
    assert float(rows[0]["episodic_aoi"]) == next(iter(found.cells.values()))[0]["metrics"]["episodic_aoi"]


def test_without_matplotlib_there_are_tables_and_one_line_that_says_so(found, tmp_path, monkeypatch):
    monkeypatch.setattr(plots, "can_plot", lambda: False)
    names = {path.name for path in write_report(tmp_path, found)}
    assert names == {"README.md", "campaigns.csv", "timing.csv"}
    assert "No plots: matplotlib is not installed" in (tmp_path / "README.md").read_text()


def test_a_quick_run_warns_against_comparing(found):
    quick = Findings(found.grid, found.campuses, {}, found.cells, {}, ORIGIN, quick=True)
    assert "cannot be set against the paper's" in page(quick)
    assert "cannot be set against the paper's" not in page(found)


def test_the_paper_s_tables_agree_with_each_other_and_are_whole():
    assert len(TABLE_I) == 3 * 4 * 3
    assert len(TABLE_II_MS) == 5 * 3
    assert len(TABLE_III) == 4 * 3
    for campus in CAMPUSES:
        assert TABLE_III["gcrl", campus] == TABLE_I["gaussian", 3, campus]  # the same model twice (Section VII-C)
    for row in (*TABLE_I.values(), *TABLE_III.values()):
        assert row.episodic_aoi >= 1.0
        assert all(0.0 < share < 1.0 for share in row[1:])


def test_the_paper_s_text_follows_from_its_table_iii():
    """Section VII-E: 71, 66 and 63 % lower than without RGCN; 37, 27 and 31 % lower than without prediction."""
    for campus, without_rgcn, without_pred in (("purdue", 0.71, 0.37), ("ncsu", 0.66, 0.27), ("kaist", 0.63, 0.31)):
        whole = TABLE_III["gcrl", campus].episodic_aoi
        assert 1.0 - whole / TABLE_III["w/o RGCN", campus].episodic_aoi == pytest.approx(without_rgcn, abs=0.01)
        assert 1.0 - whole / TABLE_III["w/o pred", campus].episodic_aoi == pytest.approx(without_pred, abs=0.01)


def test_methods_are_drawn_only_where_they_flew(found):
    figure = plots.curves("uavs", "tiny", found.grid, found.cells)
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert labels == [row.name for row in found.grid.methods if isinstance(row.method, Method) and "random" in row.name]


def test_every_method_has_a_line_of_its_own(found):
    names = (*POLICIES, "random, may leave the map")
    assert len(names) <= min(len(plots.COLOURS), len(set(plots.MARKS)))
    legend = plots.curves("uavs", "tiny", found.grid, found.cells).legends[0]
    assert [text.get_text() for text in legend.get_texts()]
