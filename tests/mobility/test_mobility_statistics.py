"""Figures by hand on small crowds, and the synthetic crowds beside the real ones."""

import math
from dataclasses import asdict
from statistics import fmean

import numpy as np
import pytest

from policy.mobility.__main__ import main, synthetic_statistics
from policy.mobility.presets import REAL_SETS, RealSet
from policy.mobility.statistics import fix_interval_samples, mobility_statistics
from policy.mobility.traces import UserTraces


def crowd(*easting_m: list[float]) -> UserTraces:
    """One list of eastings a user, all on the line north = 50."""
    east_m = np.array(easting_m).T
    pos_enu_m = np.stack([east_m, np.full_like(east_m, 50.0)], axis=-1)
    return UserTraces(tuple(f"u{user}" for user in range(len(easting_m))), pos_enu_m, 15.0, "by hand")


def test_by_hand() -> None:
    """One walks 10, 20, 0, 0, 30; the other stands in a square of its own."""
    figures = mobility_statistics(crowd([0, 10, 30, 30, 30, 60], [250] * 6))
    assert figures.standing_share == pytest.approx(7 / 10)
    assert (figures.step_median_m, figures.fix_interval_s) == (20.0, 15.0)
    assert figures.pause_mean_s == pytest.approx(15.0 * (2 + 5) / 2)
    assert figures.gyration_median_m == pytest.approx(np.std([0, 10, 30, 30, 30, 60]) / 2)
    assert figures.top_cells_share == pytest.approx(1.0)
    assert figures.effective_cells == pytest.approx(2.0)
    assert figures.spread_m == pytest.approx(np.std([0, 10, 30, 30, 30, 60] + [250] * 6))


def test_entropy_of_unequal_squares() -> None:
    figures = mobility_statistics(crowd([0, 0, 0, 150]))
    assert figures.effective_cells == pytest.approx(math.exp(-(0.75 * math.log(0.75) + 0.25 * math.log(0.25))))


def test_repeated_fixes_are_not_taken_for_standing() -> None:
    """Fixes at samples 1, 3, 5 (sample 0 repeats an earlier one), one of them without motion."""
    traces = crowd([0, 10, 10, 20, 20, 20, 20, 40])
    assert fix_interval_samples(traces.pos_enu_m) == (2, 1)
    figures = mobility_statistics(traces)
    assert figures.standing_share == pytest.approx(4 / 7)
    assert figures.fix_standing_share == pytest.approx(1 / 3)


def test_a_crowd_that_stands() -> None:
    figures = mobility_statistics(crowd([5] * 4))
    assert (figures.standing_share, figures.step_p90_m, figures.pause_p90_s) == (1.0, 0.0, 45.0)


# Largest factor between the mean of 20 synthetic crowds and the real one; one campus is one draw itself.
FACTORS = {
    "standing_share": 1.05,
    "fix_interval_s": 1.0,
    "fix_standing_share": 1.2,
    "step_median_m": 1.5,
    "step_p90_m": 1.35,
    "step_p99_m": 1.35,
    "pause_mean_s": 1.4,
    "pause_p90_s": 1.35,
    "gyration_median_m": 1.35,
    "gyration_p90_m": 1.35,
    "top_cells_share": 1.2,
    "effective_cells": 1.35,
    "spread_m": 1.25,
}


@pytest.mark.traces
@pytest.mark.parametrize("real", REAL_SETS, ids=lambda real: real.preset)
def test_presets_move_like_the_real_sets(real: RealSet, real_traces: dict[str, UserTraces]) -> None:
    traces = real_traces[real.file]
    measured = asdict(mobility_statistics(traces))
    crowds = [asdict(figures) for figures in synthetic_statistics(real, traces.num_users, 20)]
    off = {name: fmean(figures[name] for figures in crowds) / value for name, value in measured.items()}
    assert {name: ratio for name, ratio in off.items() if not 1 / FACTORS[name] <= ratio <= FACTORS[name]} == {}


@pytest.mark.traces
def test_two_sets_repeat_fixes_of_30_s(real_traces: dict[str, UserTraces]) -> None:
    """Why 67 % and 64 % of slots show no motion there."""
    intervals = {file: fix_interval_samples(traces.pos_enu_m)[0] for file, traces in real_traces.items()}
    assert intervals == {"purdue_59.csv": 1, "ncsu_33.csv": 2, "kaist_92.csv": 2}
    shares = [mobility_statistics(real_traces[real.file]).standing_share for real in REAL_SETS]
    assert [round(share, 2) for share in shares] == [0.87, 0.67, 0.64]


@pytest.mark.traces
def test_prints_a_table_a_set(real_traces: dict[str, UserTraces], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--seeds", "1"]) == 0
    assert capsys.readouterr().out.count("| standing_share | 0.") == 3


def test_says_where_it_looked_for_the_real_sets(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("UCS_DATA_DIR", "/absent")
    assert main([]) == 2
    assert capsys.readouterr().err.splitlines() == [
        "trace 'purdue_59.csv' not found in /absent: put it there, or set UCS_DATA_DIR"
    ]


@pytest.mark.parametrize("arguments", [["--seeds", "0"], ["--seeds", "many"], ["--unknown"]])
def test_a_usage_error_is_one_line(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(arguments)
    assert len(capsys.readouterr().err.splitlines()) == 1
