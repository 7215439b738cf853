"""The page's build, as Python alone sees it."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

PAGE = Path(__file__).resolve().parents[2] / "gcs" / "dashboard"


@pytest.fixture
def build(tmp_path: Path) -> ModuleType:
    """The build script, copied with a page of few files, so that nothing real is touched."""
    page = tmp_path / "gcs" / "dashboard"
    (page / "src").mkdir(parents=True)
    (page / "public").mkdir()
    for name in ("build.py", "package.json", "package-lock.json", "tsconfig.json", "vite.config.ts", "index.html"):
        shutil.copy(PAGE / name, page / name)
    spec = importlib.util.spec_from_file_location("page_build", page / "build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["page_build"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("version", "good"),
    [("v20.19.0", True), ("v20.18.9", False), ("v21.7.0", False), ("v22.11.0", False), ("v22.12.0", True),
     ("v24.1.0", True), ("v18.20.0", False), ("", False), ("rubbish", False)],
)  # fmt: skip
def test_node_must_be_what_vite_asks_for(build: ModuleType, version: str, good: bool):
    assert build.node_is_new_enough(version) is good


def test_a_page_is_fresh_until_a_source_is_newer(build: ModuleType):
    assert not build.is_fresh()
    build.DIST.mkdir()
    built = build.DIST / "index.html"
    built.write_text("built")
    for path in build.source_files():
        os.utime(path, (1000, 1000))
    os.utime(built, (2000, 2000))
    assert build.is_fresh()
    (build.PAGE / "src" / "new.ts").write_text("")
    assert not build.is_fresh()


def test_a_fresh_page_needs_no_tools(build: ModuleType, monkeypatch: pytest.MonkeyPatch):
    build.DIST.mkdir()
    (build.DIST / "index.html").write_text("built")
    monkeypatch.setenv("PATH", "")
    assert build.main([]) == 0


def test_a_failure_is_one_line_that_says_what_and_where(build: ModuleType):
    with pytest.raises(build.BuildError) as failure:
        build.call(
            [sys.executable, "-c", "print('x'); print('Error: no such thing'); raise SystemExit(3)"], "npm run build"
        )
    assert str(failure.value).startswith("'npm run build' failed (exit 3): Error: no such thing;")
    assert "\n" not in str(failure.value)


@pytest.mark.parametrize("holes", [0, 1])
def test_known_holes_are_looked_up_and_one_is_a_failure(
    build: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, holes: int
):
    npm, said = tmp_path / "npm", tmp_path / "said"
    npm.write_text(f'#!/bin/sh\necho "$@" >> {said}\n[ "$1" != audit ] || exit {holes}\n')
    npm.chmod(0o755)
    monkeypatch.setattr(build, "find_toolchain", lambda: build.Toolchain(npm, tmp_path))
    monkeypatch.setattr(build, "is_fresh", lambda: True)
    build.NODE_MODULES.mkdir()
    assert build.main(["--audit"]) == holes
    assert said.read_text().splitlines()[-1] == "audit --audit-level=low"


def test_the_lock_file_names_no_registry():
    packages = json.loads((PAGE / "package-lock.json").read_text("utf-8"))["packages"]
    assert not [name for name, entry in packages.items() if "resolved" in entry]


def test_the_pages_own_unit_tests_pass():
    done = subprocess.run(
        [sys.executable, str(PAGE / "build.py"), "--test"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
