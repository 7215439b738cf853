"""The wheel as another machine gets it: what is inside, and that ``pipx run`` flies and serves from it."""

import json
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from pipx_home import Pipx, base_install, make_pipx

ROOT = Path(__file__).resolve().parents[2]
WAIT_S = 60.0
MAX_BYTES = 12_000_000
SHORT = """[campaign]
name = "short"
slots = 1
slot_s = 15.0
[area]
south_west = [47.3960, 8.5400]
size_m = [900.0, 700.0]
[fleet]
uavs = 1
altitude_m = 30.0
max_speed_mps = 15.0
launch_m = [450.0, 350.0]
[users]
source = "walkers"
count = 2
[policy]
name = "random"
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from this tree with the page as it is; ``make test`` has built that before."""
    assert (ROOT / "gcs" / "dashboard" / "dist" / "index.html").is_file(), "build the page first: make page"
    folder = tmp_path_factory.mktemp("wheel")
    words = ["--quiet", "--disable-pip-version-check", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder)]
    command = [sys.executable, "-m", "pip", "wheel", *words, str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def pipx(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Pipx:
    """Makes the wheel's environment with its first ``run`` and keeps it for the others."""
    return make_pipx(tmp_path_factory.mktemp("pipx"), wheel)


def run(pipx: Pipx, folder: Path, *words: str, compiled: bool = True) -> str:
    """What a program printed; without ``compiled`` its loops are interpreted, which spares half a minute here."""
    environment = pipx.environment | ({} if compiled else {"NUMBA_DISABLE_JIT": "1"})
    done = subprocess.run(
        [*pipx.command, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=170, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_what_a_machine_needs_is_inside_and_nothing_else(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    for name in (
        "gcs/dashboard/dist/index.html",
        "gcs/missions/demo.toml",
        "gcs/report/templates/report.html.j2",
        "gcs/store/migrations/versions/0001_first_tables.py",
        "gcs/py.typed",
        "policy/checkpoints/gcrl-default.onnx",
        "policy/checkpoints/gcrl-default.json",
    ):
        assert name in names
    assert any(name.endswith(".js") and "dist/assets" in name for name in names)
    assert not [name for name in names if "node_modules" in name or "/test" in name or name.endswith((".ts", ".tsx"))]
    assert wheel.stat().st_size < MAX_BYTES


def test_its_metadata_names_the_programs(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        texts = {Path(name).name: archive.read(name).decode() for name in archive.namelist() if ".dist-info/" in name}
    assert set(re.findall(r"^([\w-]+) =", texts["entry_points.txt"], re.MULTILINE)) == {"gcs", "policy", "sitl-mock"}
    assert "License-Expression: Apache-2.0" in texts["METADATA"]


def test_pipx_runs_it_with_the_base_install_alone(pipx: Pipx, tmp_path: Path) -> None:
    assert re.fullmatch(r"gcs \d+\.\d+\.\d+\n", run(pipx, tmp_path, "gcs", "--version"))
    seen = {one["check"]: one for one in json.loads(run(pipx, tmp_path, "gcs", "doctor", "--port", "0", "--json"))}
    assert [one for one in seen.values() if one["grade"] == "red"] == []
    assert seen["operator's page"]["found"] == "built"
    assert "torch" not in {name.partition("-")[0] for name in base_install()}


def test_pipx_flies_a_campaign_from_an_empty_folder(pipx: Pipx, tmp_path: Path) -> None:
    mission = tmp_path / "short.toml"
    mission.write_text(SHORT)
    words = ("gcs", "fly", mission.name, "--fleet", "mock", "--speedup", "max", "--json", "result.json")
    run(pipx, tmp_path, *words, compiled=False)
    result = json.loads((tmp_path / "result.json").read_text())
    assert (result["mission"], result["slots"], set(result["violations"].values())) == ("short", 1, {0})


def test_pipx_serves_the_page_and_the_missions_inside(pipx: Pipx, tmp_path: Path) -> None:
    with serving(pipx, tmp_path) as address:
        page = httpx.get(address, timeout=WAIT_S, trust_env=False)
        script = re.search(r'src="\./?(assets/[^"]+\.js)"|src="/?(assets/[^"]+\.js)"', page.text)
        assert script is not None, page.text[:500]
        path = script[1] or script[2]
        assert httpx.get(f"{address}/{path}", timeout=WAIT_S, trust_env=False).status_code == 200
        assert "demo" in httpx.get(f"{address}/api/v1/missions", timeout=WAIT_S, trust_env=False).text


@contextmanager
def serving(pipx: Pipx, folder: Path) -> Iterator[str]:
    process = subprocess.Popen(
        [*pipx.command, "gcs", "serve", "--port", "0"],
        cwd=folder,
        env=pipx.environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    said = ""
    try:
        for line in process.stdout:
            said += line
            found = re.search(r"open (\S+?)/?$", line)
            if found:
                yield found[1]
                return
        pytest.fail(f"the server did not start: {said}")
    finally:
        process.kill()  # pipx has become the server
        process.communicate()
