"""A pipx of its own, without network: the base install's libraries are there already, the software is not.

pipx shows every environment that it makes one shared folder, meant for pip. Here this folder also has links to exactly
the libraries that the base install asks for, with all that those ask for. So pip checks the wheel's own requirements
against them and fetches nothing, and what only the tools of the tests have is not there: a library that the software
imports and does not ask for is missing here as on a user's machine.
"""

import importlib.metadata
import os
import sys
import venv
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PACKAGE = "uav-crowdsensing"


@dataclass(frozen=True)
class Pipx:
    """How to run pipx in a folder of its own: ``[*command, "gcs", ...]`` with ``environment``."""

    command: tuple[str, ...]
    environment: dict[str, str]


def make_pipx(home: Path, wheel: Path) -> Pipx:
    """``pipx run`` of the wheel's programs."""
    shared = home / "shared"
    _share(shared)
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PIP", "PYTHON"))}
    environment |= {
        "PIPX_HOME": str(home),
        "PIPX_SHARED_LIBS": str(shared),
        "PIPX_DISABLE_SHARED_LIBS_AUTO_UPGRADE": "1",
        "PIPX_DEFAULT_BACKEND": "pip",
        "PIP_NO_INDEX": "1",
        "PIP_CONFIG_FILE": os.devnull,
    }
    words = ("-m", "pipx", "run", "--python", sys.executable, "--spec", str(wheel))
    return Pipx((sys.executable, *words), environment)


def base_install() -> dict[str, Distribution]:
    """The libraries of the base install by name, without the software itself."""
    found: dict[str, Distribution] = {}
    seen: set[str] = set()
    waiting = [Requirement(PACKAGE)]
    while waiting:
        wanted = waiting.pop()
        if str(wanted) in seen:
            continue
        seen.add(str(wanted))
        one = importlib.metadata.distribution(wanted.name)
        found[canonicalize_name(wanted.name)] = one
        waiting.extend(_asked_by(one, wanted.extras))
    del found[PACKAGE]
    return found


def _asked_by(one: Distribution, extras: set[str]) -> Iterator[Requirement]:
    for text in one.requires or ():
        asked = Requirement(text)
        if asked.marker is None or any(asked.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
            yield asked


def _share(folder: Path) -> None:
    """What pipx takes for its shared folder: an environment with a pip."""
    venv.EnvBuilder(with_pip=False, symlinks=True).create(folder)
    (site,) = folder.glob("lib/*/site-packages")
    for one in (*base_install().values(), importlib.metadata.distribution("pip")):
        for name in {file.parts[0] for file in one.files or ()} - {"..", "__pycache__"}:
            if not (site / name).exists():
                (site / name).symlink_to(Path(str(one.locate_file(name))))
    (folder / "bin" / "pip").touch()
