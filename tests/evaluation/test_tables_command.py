"""``policy tables`` from outside: quick runs, restarts, faults, the loader."""

import importlib
import json
from pathlib import Path

import pandas as pd
import pytest

from policy.__main__ import main
from policy.evaluation.tables import load_frame, load_results
from policy.evaluation.tables.grid import SECTIONS


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    try:
        code = main(["tables", *arguments])
    except SystemExit as stop:
        code = int(stop.code or 0)
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_quick_on_a_tiny_mission_then_again(capsys, tiny, tmp_path):
    out = tmp_path / "out"
    arguments = ["--quick", "--missions", str(tiny), "--policies", "random", "--out", str(out), "--workers", "2"]
    code, said, err = run(capsys, *arguments)
    assert code == 0, err
    cells = len(list((out / "cells").glob("*.json")))
    assert f"{cells - 1} campaigns flown, 0 found" in said  # one of the files is the timing
    text = (out / "README.md").read_text()
    for title in ("Table II", "All methods", "number of UAVs", "MCL, U = 2", "Trajectories"):
        assert title in text
    assert "![tiny](uavs-tiny.svg)" in text
    assert "20 slots" in text

    (victim,) = [path for path in sorted((out / "cells").glob("*.json")) if "timing" not in path.name][:1]
    victim.unlink()
    code, said, _ = run(capsys, *arguments)
    assert (code, said.split(" campaigns flown, ")[0]) == (0, "1")
    assert victim.is_file()

    rows = load_results(out)
    assert len(rows) == cells - 1
    assert {row["policy"] for row in rows} == {"random"}
    assert {row["uavs"] for row in rows} == {2, 3}
    assert all(not isinstance(value, dict | list) for row in rows for value in row.values())
    frame = load_frame(out)
    assert isinstance(frame, pd.DataFrame)
    assert list(frame["episodic_aoi"]) == [row["episodic_aoi"] for row in rows]


def test_only_the_depths_asked_for_are_flown(tmp_path, capsys, tiny):
    out = tmp_path / "out"
    arguments = [
        "--only",
        "table1",
        "--depths",
        "1",
        "2",
        "1",
        "--missions",
        str(tiny),
        "--seeds",
        "1",
        "--out",
        str(out),
    ]
    code, _, err = run(capsys, *arguments, "--workers", "1")
    assert code == 0, err
    rows = [
        line.split(" | ") for line in (out / "README.md").read_text().splitlines() if line.startswith("| gaussian |")
    ]
    assert [row[1] for row in rows] == ["1", "2"]
    assert "missing" not in rows[1]


def test_a_page_of_what_is_there_flies_nothing(tmp_path, capsys, tiny):
    out, only = tmp_path / "out", ["--only", "methods", "--missions", str(tiny), "--policies", "random"]
    assert run(capsys, *only, "--seeds", "1", "--out", str(out), "--workers", "1")[0] == 0
    cells = sorted((out / "cells").glob("*.json"))
    assert "not flown" not in (out / "README.md").read_text()
    code, said, _ = run(capsys, *only, "--seeds", "3", "--out", str(out), "--kept")
    assert (code, said.split(";")[0]) == (0, f"0 campaigns flown, 2 found in {out}")
    assert sorted((out / "cells").glob("*.json")) == cells
    assert "**4 campaigns were not flown**" in (out / "README.md").read_text()


def test_the_newest_of_a_cell_flown_twice_counts(tmp_path, capsys, tiny):
    out = tmp_path / "out"
    run(capsys, "--only", "methods", "--missions", str(tiny), "--policies", "random", "--seeds", "1", "--out", str(out))
    (first, *_) = sorted((out / "cells").glob("*.json"))
    cell = json.loads(first.read_text())
    older = {**cell, "key": "older", "code": "older", "finished_utc": "2001-01-01T00:00:00+00:00"}
    (out / "cells" / "older.json").write_text(json.dumps(older))
    assert "older" not in {row["code"] for row in load_results(out)}
    assert len(load_results(out)) == 2  # inside the map, and as the paper has it


def test_only_what_is_asked_for_is_in_the_page(capsys, tiny, tmp_path):
    arguments = ["--missions", str(tiny), "--policies", "random", "--seeds", "1", "--out", str(tmp_path / "o")]
    assert run(capsys, "--only", "table2", *arguments)[0] == 0
    text = (tmp_path / "o" / "README.md").read_text()
    assert "Table II" in text
    assert "All methods" not in text
    assert not (tmp_path / "o" / "campaigns.csv").exists()


def test_curves_relations_and_next_states_are_in_the_page(capsys, tiny, tmp_path):
    out = tmp_path / "o"
    only = ["--only", "nextstate", "relations", "curves", "--missions", str(tiny), "--seeds", "1", "--out", str(out)]
    code, said, err = run(capsys, *only, "--workers", "1")
    assert code == 0, err
    assert "4 campaigns flown" in said
    text = (out / "README.md").read_text()
    assert "![tiny, as Fig. 2](relations-tiny.svg)" in text
    assert "![curves](curves.svg)" in text
    assert {path.suffix for path in out.glob("relations-tiny.*")} == {".svg", ".png"}
    kappa = {row["options"]: row["episodic_aoi"] for row in load_results(out)}
    assert len(kappa) == 4
    for kind in ("exact", "hybrid", "learned", "printed"):
        (value,) = [kappa[options] for options in kappa if f'"next_state":"{kind}"' in options]
        assert f"| κ | {kind} | {value:.3f} |" in text
    assert "| gcrl-default | gaussian | 500 | 6.042 |" in text


def test_without_traces_quick_flies_the_demo_and_says_what_is_missing(capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("UCS_DATA_DIR", str(tmp_path))
    out = tmp_path / "o"
    code, _, err = run(capsys, "--quick", "--only", "methods", "--policies", "random", "--out", str(out))
    assert code == 0, err
    for name in ("purdue", "ncsu", "kaist"):
        assert f"{name}: not flown" in err
        assert f"- {name}: not flown" in (out / "README.md").read_text()
    assert "### demo" in (out / "README.md").read_text()
    code, _, err = run(capsys, "--only", "methods", "--out", str(out))
    assert code == 2
    assert "nothing to fly" in err
    assert len(err.strip().splitlines()) == 1


FAULTS = [
    (["--only", "table9"], "invalid choice"),
    (["--seeds", "0"], "not between"),
    (["--depths", "2", "6"], "not between"),
    (["--workers", "many"], "no whole number"),
    (["--policies", "randon"], 'did you mean "random"?'),
    (["--missions", "nowhere"], "no such mission"),
    (["--missions", "demo", "./missions/demo.toml"], "named alike"),
    (["--missions", "demo", "--checkpoints", "absent"], "no such folder"),
]


@pytest.mark.parametrize(("arguments", "complaint"), FAULTS)
def test_faults_are_one_line_and_leave_no_page(capsys, tmp_path, arguments, complaint):
    code, out, err = run(capsys, "--quick", "--out", str(tmp_path / "o"), *arguments)
    assert (code, out) == (2, "")
    assert complaint in err
    assert len(err.strip().splitlines()) == 1
    assert not (tmp_path / "o" / "README.md").exists()


def test_an_output_folder_that_is_a_file_is_one_line(capsys, tmp_path):
    (tmp_path / "file").write_text("")
    code, _, err = run(capsys, "--quick", "--missions", "demo", "--out", str(tmp_path / "file"))
    assert code == 2
    assert "cannot be made a results folder" in err


def test_ray_that_is_not_installed_is_one_line(capsys, tiny, tmp_path, monkeypatch):
    real = importlib.import_module

    def without(name, package=None):
        if name == "ray":
            raise ModuleNotFoundError(name)
        return real(name, package)

    monkeypatch.setattr(importlib, "import_module", without)
    arguments = ["--only", "methods", "--missions", str(tiny), "--policies", "random", "--out", str(tmp_path / "o")]
    code, _, err = run(capsys, *arguments, "--ray", "local")
    assert code == 2
    assert "[scale] extra" in err
    assert len(err.strip().splitlines()) == 1


def test_help_names_every_section(capsys):
    code, out, _ = run(capsys, "--help")
    assert code == 0
    assert all(section in out for section in SECTIONS)


def test_the_loader_of_a_folder_without_cells_gives_no_rows(tmp_path):
    assert load_results(tmp_path) == []
    assert load_results(Path(tmp_path) / "absent") == []
