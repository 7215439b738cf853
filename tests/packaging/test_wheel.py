"""The wheel as another machine gets it: what is inside, and that it runs without the clone."""

import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

ROOT = Path(__file__).resolve().parents[2]
WAIT_S = 60.0
MAX_BYTES = 12_000_000


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
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Unpacked where only PYTHONPATH finds it; the libraries are this environment's."""
    folder = tmp_path_factory.mktemp("installed")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def environment(installed: Path) -> dict[str, str]:
    return os.environ | {"PYTHONPATH": str(installed), "PYTHONSAFEPATH": "1"}


def run(installed: Path, folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, *words]
    return subprocess.run(
        command, cwd=folder, env=environment(installed), capture_output=True, text=True, timeout=120, check=False
    )


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


def test_its_metadata_names_the_programs(installed: Path) -> None:
    (facts,) = installed.glob("*.dist-info")
    scripts = (facts / "entry_points.txt").read_text()
    assert set(re.findall(r"^([\w-]+) =", scripts, re.MULTILINE)) == {"gcs", "policy", "sitl-mock"}
    assert "License-Expression: Apache-2.0" in (facts / "METADATA").read_text()


def test_it_runs_from_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    where = run(installed, tmp_path, "-c", "import gcs, policy; print(gcs.__file__, policy.__file__)")
    assert [Path(file).is_relative_to(installed) for file in where.stdout.split()] == [True, True], where
    scored = run(installed, tmp_path, "-m", "policy", "evaluate", "demo", "--policy", "random", "--slots", "2")
    assert scored.returncode == 0, scored.stderr


def test_it_serves_its_own_page(installed: Path, tmp_path: Path) -> None:
    with serving(installed, tmp_path) as address:
        page = httpx.get(address, timeout=WAIT_S, trust_env=False)
        script = re.search(r'src="\./?(assets/[^"]+\.js)"|src="/?(assets/[^"]+\.js)"', page.text)
        assert script is not None, page.text[:500]
        path = script[1] or script[2]
        assert httpx.get(f"{address}/{path}", timeout=WAIT_S, trust_env=False).status_code == 200
        assert "demo" in httpx.get(f"{address}/api/v1/missions", timeout=WAIT_S, trust_env=False).text


@contextmanager
def serving(installed: Path, folder: Path) -> Iterator[str]:
    command = [sys.executable, "-m", "gcs", "serve", "--port", "0"]
    process = subprocess.Popen(
        command, cwd=folder, env=environment(installed), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
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
        process.kill()
        process.communicate()
