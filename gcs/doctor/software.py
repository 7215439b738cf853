"""Versions and files: Python, packages, the operator's page, the shipped model, the compile cache, missions."""

import importlib
import importlib.metadata
import os
import platform
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from gcs.doctor.finding import Finding, caution, ok, red
from policy.agents.registry import UnknownPolicyError, make_agent
from policy.mission_file import MissionError, list_missions, load_mission
from policy.mobility.reader import DATA_DIR_VARIABLE, find_trace
from policy.mobility.traces import TraceError
from policy.model.checkpoint_error import CheckpointError

PACKAGE = "uav-crowdsensing"
NATIVE = ("numba", "onnxruntime", "pymavlink.dialects.v20.ardupilotmega")  # those that fail to load on odd machines


def check_python(running: str, wanted: str) -> Finding:
    """``wanted`` as in ``requires-python``."""
    if SpecifierSet(wanted).contains(running):
        return ok("python", running)
    return red("python", f"{running}; {wanted} is needed", "make the virtual environment anew with such a Python")


def check_packages(requirements: Iterable[str]) -> Finding:
    """The base install's requirements; those of extras are passed over."""
    wrong: list[str] = []
    count = 0
    for text in requirements:
        wanted = Requirement(text)
        if wanted.marker is not None and not wanted.marker.evaluate({"extra": ""}):
            continue
        count += 1
        try:
            version = importlib.metadata.version(wanted.name)
        except importlib.metadata.PackageNotFoundError:
            wrong.append(f"{wanted.name} is missing")
            continue
        if not wanted.specifier.contains(version, prereleases=True):
            wrong.append(f"{wanted.name} {version} is not {wanted.specifier}")
    if wrong:
        return red("packages", "; ".join(wrong), f"pip install --upgrade {PACKAGE} (or pip install -e . in a clone)")
    return ok("packages", f"{count} of the base install, all as wanted")


def check_native() -> Finding:
    """Compiled libraries load."""
    for name in NATIVE:
        try:
            importlib.import_module(name)
        except (ImportError, OSError) as error:
            words = " ".join(str(error).split())
            return red("compiled libraries", f"{name}: {words}", f"pip install --force-reinstall {name.split('.')[0]}")
    return ok("compiled libraries", ", ".join(name.split(".")[0] for name in NATIVE))


def check_page(dashboard: Path) -> Finding:
    """The operator's page is built."""
    if (dashboard / "index.html").is_file():
        return ok("operator's page", "built")
    remedy = "in a clone: python gcs/dashboard/build.py; else install a released wheel, which has the page inside"
    return caution("operator's page", "not built; the server runs and shows none", remedy)


def check_cache(folder: str | None) -> Finding:
    """Numba keeps compiled code in NUMBA_CACHE_DIR, or beside the sources."""
    place = Path(folder) if folder else Path(importlib.import_module("policy").__file__ or ".").parent
    if _writable(place):
        return ok("compile cache", "NUMBA_CACHE_DIR" if folder else "beside the sources")
    remedy = "set NUMBA_CACHE_DIR to a folder of yours"
    return caution("compile cache", "cannot be written: every start compiles anew, for up to a minute", remedy)


def check_model() -> Finding:
    """The shipped network loads and is the one that its card names."""
    try:
        make_agent("gcrl")
    except (CheckpointError, UnknownPolicyError) as error:
        return red(
            "model of gcrl", " ".join(str(error).split()), "install again, or fly with --policy receding-horizon"
        )
    return ok("model of gcrl", "loads, digest as its card says")


def check_missions() -> Iterator[Finding]:
    """Missions at hand and their traces."""
    ready: list[str] = []
    for name, path in sorted(list_missions().items()):
        try:
            mission = load_mission(path)
            if mission.users.trace is not None:
                find_trace(mission.users.trace, mission.directory)
        except TraceError:
            yield caution(
                f"mission {name}",
                f"its trace {mission.users.trace} is not at hand",
                f"set {DATA_DIR_VARIABLE} to the folder that has it (docs/mobility.md); demo needs none",
            )
        except MissionError as error:
            yield caution(f"mission {name}", " ".join(str(error).split()), "mend the file; the line says where")
        else:
            ready.append(name)
    yield ok("missions", ", ".join(ready) or "none")


def software(dashboard: Path) -> Iterator[Finding]:
    """All of the above for this process."""
    try:
        facts = importlib.metadata.metadata(PACKAGE)
    except importlib.metadata.PackageNotFoundError:
        yield red("packages", f"{PACKAGE} is not installed", "pip install -e . in the clone, or install the wheel")
    else:
        yield check_python(platform.python_version(), facts["Requires-Python"])
        yield check_packages(importlib.metadata.requires(PACKAGE) or ())
    yield check_native()
    yield check_page(dashboard)
    yield check_cache(os.environ.get("NUMBA_CACHE_DIR"))
    yield check_model()
    yield from check_missions()


def _writable(folder: Path) -> bool:
    """By trying: permission bits do not tell of read-only mounts."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
