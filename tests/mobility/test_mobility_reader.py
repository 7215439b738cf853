"""Trace files: what is mended, what is refused, and that nothing else ever comes out."""

import csv
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from policy.mobility import reader
from policy.mobility.reader import find_trace, read_traces
from policy.mobility.traces import TraceError, UserTraces
from policy.world.frames import LocalFrame

WriteCsv = Callable[[str], Path]
AREA_M = (1000.0, 800.0)
HEADER = "id,timestamp,x_distance,y_distance\n"


def read(path: Path, num_samples: int = 3, south_west_deg: tuple[float, float] | None = None) -> UserTraces:
    return read_traces(path, area_size_m=AREA_M, num_samples=num_samples, slot_s=15.0, south_west_deg=south_west_deg)


def rows(*fixes: tuple[object, object, object, object]) -> str:
    return HEADER + "".join(",".join(map(str, fix)) + "\n" for fix in fixes)


def test_reads_by_column_name_in_any_order(write_csv: WriteCsv) -> None:
    path = write_csv("y_distance,x,timestamp,x_distance,id\n2,9,100,1,a\n4,9,115,3,a\n6,9,130,5,a\n")
    traces = read(path)
    assert (traces.user_ids, traces.slot_s, traces.source) == (("a",), 15.0, "users.csv")
    np.testing.assert_array_equal(traces.pos_enu_m[:, 0], [[1, 2], [3, 4], [5, 6]])


def test_orders_users_by_id_whatever_the_rows(write_csv: WriteCsv) -> None:
    path = write_csv(rows(("10", 0, 1, 1), ("b", 0, 2, 2), ("9", 0, 3, 3), ("a", 0, 4, 4)))
    assert read(path, num_samples=1).user_ids == ("9", "10", "a", "b")


@given(order=st.permutations(range(9)))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_the_order_of_rows_does_not_matter(order: list[int], write_csv: WriteCsv) -> None:
    fixes = [(user, 15 * slot, 10 * user + slot, slot) for user in range(3) for slot in range(3)]
    traces = read(write_csv(rows(*(fixes[index] for index in order))))
    np.testing.assert_array_equal(traces.pos_enu_m[:, 2], [[20, 0], [21, 1], [22, 2]])


def test_resamples_other_spacings_linearly(write_csv: WriteCsv) -> None:
    traces = read(write_csv(rows(("a", 0, 0, 0), ("a", 20, 200, 20), ("a", 40, 200, 40))))
    np.testing.assert_allclose(traces.pos_enu_m[:, 0], [[0, 0], [150, 15], [200, 30]])


def test_degrees_are_metres_from_the_south_west_corner(write_csv: WriteCsv) -> None:
    lat_deg, lon_deg = LocalFrame(40.0, -86.0).to_geodetic_deg(np.float64(120.0), np.float64(340.0))
    path = write_csv(f"id,latitude,longitude,timestamp\na,{lat_deg:.9f},{lon_deg:.9f},5\n")
    np.testing.assert_allclose(read(path, 1, (40.0, -86.0)).pos_enu_m[0, 0], [120.0, 340.0], atol=1e-3)
    with pytest.raises(TraceError, match="need the area's south_west corner"):
        read(path, 1)


def test_bridges_missing_numbers_and_says_so(write_csv: WriteCsv) -> None:
    traces = read(write_csv(rows(("a", 0, 0, 0), ("a", 15, "NaN", 5), ("a", 30, 20, ""), ("a", 45, 30, 0))), 4)
    np.testing.assert_allclose(traces.pos_enu_m[:, 0, 0], [0, 10, 20, 30])
    assert traces.notes == ("2 rows without a number dropped",)


def test_drops_repeated_rows_and_blank_lines(write_csv: WriteCsv) -> None:
    traces = read(write_csv(rows(("a", 0, 1, 1), ("a", 0, 1, 1)) + "\n,,,\n"), 1)
    assert traces.notes == ("1 repeated rows dropped",)


def test_keeps_fixes_just_outside_and_drops_far_ones(write_csv: WriteCsv) -> None:
    traces = read(write_csv(rows(("a", 0, -99, 0), ("a", 15, 1101, 0), ("a", 30, -99, 899))))
    np.testing.assert_allclose(traces.pos_enu_m[:, 0], [[-99, 0], [-99, 449.5], [-99, 899]])
    assert traces.notes == ("1 positions far outside the area dropped",)


def test_late_starters_and_early_leavers_stand_at_their_ends(write_csv: WriteCsv) -> None:
    traces = read(write_csv(rows(("a", 0, 1, 1), ("a", 30, 3, 3), ("b", 15, 7, 8))))
    np.testing.assert_array_equal(traces.pos_enu_m[:, 1], [[7, 8], [7, 8], [7, 8]])


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", r"users.csv:1: the header needs id, timestamp .* found 'nothing'"),
        ("a,b,c\n1,2,3\n", r":1: the header needs .* found 'a, b, c'"),
        ("id,id,timestamp,x_distance,y_distance\n1,1,0,1,1\n", ":1: column 'id' stands twice"),
        (HEADER, "no rows below the header"),
        (rows(("a", 0, 1, 1), ("a", 15, "east", 1)), ":3: x_distance 'east' is not a number"),
        (rows(("a", "noon", 1, 1)), ":2: timestamp 'noon' is not a number"),
        (HEADER + "a,0,1\n", ":2: 3 fields where the header has 4"),
        (HEADER + "a,0,1,1,5,3\n", ":2: 6 fields where the header has 4"),
        (rows(("", 0, 1, 1)), ":2: a row without an id"),
        (rows(("a", 0, "nan", "nan")), "no row has both a time and a position"),
        (rows(("a", 0, 5000, 5000)), ":2: every position is outside the area"),
        (rows(("a", 0, 1, 1), ("b", 0, "", "")), "user 'b' has no usable row"),
        (rows(("a", 0, 1, 1), ("b", 0, 5, 5), ("a", 0, 500, 1)), ":4: the id of line 2 at the same time, 499 m"),
        (HEADER + 'a,0,"1,1\n', "1 fields|3 fields"),
    ],
)
def test_refuses_with_the_place_and_the_remedy(text: str, complaint: str, write_csv: WriteCsv) -> None:
    with pytest.raises(TraceError, match=complaint) as caught:
        read(write_csv(text), 1)
    assert "\n" not in str(caught.value)
    assert ":" in str(caught.value).rsplit(" ", 1)[0]


@pytest.mark.parametrize(
    ("fixes", "span"),
    [
        ([("a", 0, 1, 1), ("a", 400, 1, 1), ("a", 600, 1, 1)], "from 0 s to 400 s"),
        ([("a", 0, 1, 1), ("a", 200, 1, 1)], "from 200 s to 600 s"),
        ([("a", 0, 1, 1), ("a", 300, 1, 1), ("a", 600, 1, 1), ("b", 310, 1, 1)], "from 0 s to 310 s"),
    ],
)
def test_refuses_gaps_that_cannot_be_bridged(
    fixes: list[tuple[object, object, object, object]], span: str, write_csv: WriteCsv
) -> None:
    with pytest.raises(TraceError, match=span):
        read(write_csv(rows(*fixes)), num_samples=41)


def test_what_comes_after_the_campaign_does_not_matter(write_csv: WriteCsv) -> None:
    traces = read(write_csv(rows(("a", 0, 1, 1), ("a", 40, 1, 1), ("a", 9000, 2, 2))))
    assert traces.num_samples == 3


def test_refuses_bytes_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "users.csv"
    path.write_bytes(HEADER.encode() + b"\xff\xfe\x00a,0,1,1\n")
    with pytest.raises(TraceError, match="not UTF-8"):
        read(path)
    with pytest.raises(TraceError, match="cannot be read"):
        read(tmp_path)


def test_refuses_more_users_than_memory_holds(write_csv: WriteCsv) -> None:
    text = HEADER + "".join(f"{user},0,1,1\n" for user in range(10_001))
    with pytest.raises(TraceError, match="more than 10000 users"):
        read(write_csv(text), 1)


def test_a_million_rows_are_quick(write_csv: WriteCsv) -> None:
    lines = [f"{row % 200},{15 * (row // 200)},{row % 997}.5,{row % 797}.25\n" for row in range(1_000_000)]
    path = write_csv(HEADER + "".join(lines))
    begun_s = time.process_time()
    traces = read(path, num_samples=121)
    read_s = time.process_time()
    with path.open(newline="") as file:
        assert sum(float(row["x_distance"]) >= 0.0 for row in csv.DictReader(file)) == 1_000_000
    plain_s = time.process_time() - read_s
    assert read_s - begun_s < 5.0 * plain_s  # about twice what merely splitting the rows takes on the same core
    assert traces.num_users == 200
    assert traces.pos_enu_m[0, 199, 0] == 199.5


def outcome_of(path: Path) -> UserTraces | TraceError:
    try:
        return read(path)
    except TraceError as error:
        return error


cells = st.sampled_from(["", "nan", "inf", "-1e308", "1e308", "0", "15", "30", "x", "1e3", '"', "\x00", "500", "é"])
csv_like = st.lists(st.lists(cells, min_size=3, max_size=5).map(",".join), max_size=8).map("\n".join)


@given(body=csv_like | st.text(max_size=200), with_header=st.booleans())
@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_rubbish_gives_one_clear_line_or_clean_traces(body: str, with_header: bool, tmp_path: Path) -> None:
    path = tmp_path / "rubbish.csv"
    path.write_bytes((HEADER * with_header + body).encode("utf-8", "surrogatepass"))
    outcome = outcome_of(path)
    if isinstance(outcome, TraceError):
        assert len(str(outcome).splitlines()) == 1
    else:
        assert np.all(np.isfinite(outcome.pos_enu_m))
        assert outcome.pos_enu_m.shape == (3, outcome.num_users, 2)


def test_finds_traces_beside_the_mission_then_in_the_data_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mission_dir, data_dir = tmp_path / "missions", tmp_path / "data"
    for folder in (mission_dir, data_dir):
        folder.mkdir()
        (folder / "both.csv").touch()
    (data_dir / "only.csv").touch()
    monkeypatch.setenv("UCS_DATA_DIR", str(data_dir))
    assert find_trace("both.csv", mission_dir) == mission_dir / "both.csv"
    assert find_trace("only.csv", mission_dir) == data_dir / "only.csv"
    assert find_trace(str(data_dir / "only.csv"), None) == data_dir / "only.csv"
    monkeypatch.delenv("UCS_DATA_DIR")
    monkeypatch.setattr(reader, "DEFAULT_DATA_DIR", data_dir)
    assert find_trace("only.csv", None) == data_dir / "only.csv"


@pytest.mark.parametrize("name", ["absent.csv", "", " ", "a\x00b", "x" * 5000, "/absent/file.csv"])
def test_says_where_it_looked(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UCS_DATA_DIR", str(tmp_path))
    with pytest.raises(TraceError, match=r"not found in .*UCS_DATA_DIR"):
        find_trace(name, tmp_path / "missions")


@pytest.mark.traces
def test_real_degrees_and_metres_agree(real_traces: dict[str, UserTraces], tmp_path: Path) -> None:
    """The KAIST file's own metres against our frame: two independent conversions."""
    source = find_trace("kaist_92.csv", None)
    path = tmp_path / "degrees.csv"
    text = source.read_text().replace("x_distance", "x_m").replace("y_distance", "y_m")
    path.write_text(text)
    traces = read_traces(
        path, area_size_m=(2100.21, 2174.93), num_samples=121, slot_s=15.0, south_west_deg=(36.3597, 127.3475)
    )
    apart_m = np.linalg.norm(traces.pos_enu_m - real_traces["kaist_92.csv"].pos_enu_m, axis=-1)
    assert apart_m.max() < 10.0
