"""Which of the package's sources decide a campaign's outcome, method by method: found by walking what is imported.

A cell of the tables is flown again when one of them changes, and only then: a change in one rival leaves the cells of
all others as they are. Found by reading, not by importing: nothing needs to be installed, and an import inside a
function counts like any other.
"""

import ast
import hashlib
from functools import cache
from pathlib import Path

from policy.agents import registry

PACKAGE = Path(__file__).resolve().parents[2]
FLYING = ("policy.evaluation.rollout", "policy.mobility.feed", "policy.mission_file", "policy.agents.registry")
"""What every cell is flown by, with all that these import; the registry asks for a method's own module by its name."""
CELL = "evaluation/tables/cells.py"
"""How a cell is flown and what is kept of it. What it imports beside ``FLYING`` only names and stores cells."""

ASIDE = ("evaluation/__init__.py",)
"""Imported on the way, but only for notebooks: it names the tables' readers, which decide nothing in flight."""

COMPUTES_NAMES = ("agents", "registry.py")
"""The one source that imports what it reads from a list: the methods' modules, which are asked for here by name."""


class UnknownImportError(RuntimeError):
    """A source imports what cannot be known by reading it: one line."""


@cache
def code_version(policy: str | None = None) -> str:
    """Digest of the sources that decide the outcome of ``policy``'s campaigns; None: of any method's."""
    return digest_sources(deciding(policy), PACKAGE)


def digest_sources(sources: list[Path], package: Path) -> str:
    """Of names and contents: hexadecimal."""
    digest = hashlib.sha256()
    for source in sources:
        digest.update(f"{source.relative_to(package).as_posix()}\0".encode() + source.read_bytes())
    return digest.hexdigest()[:16]


def deciding(policy: str | None = None, package: Path = PACKAGE) -> list[Path]:
    """The files behind :func:`code_version`, in the order of their names. KeyError for a policy that is not known."""
    policies = registry.POLICIES if policy is None else (policy,)
    waiting = {*FLYING, *(registry.POLICIES[name][0] for name in policies)}
    asked: set[str] = set()
    found = {package / CELL}
    while waiting - asked:
        module = (waiting - asked).pop()
        asked.add(module)
        for source in _files(module, package) - found:
            found.add(source)
            waiting.update(_imports(source.read_bytes(), source.relative_to(package.parent)))
    return sorted(found)


def _files(module: str, package: Path) -> set[Path]:
    """Of a module of the package and of the packages around it, which are imported with it; none for others'."""
    first, *rest = module.split(".")
    if first != package.name:
        return set()
    folder, files = package, {package / "__init__.py"}
    for name in rest:
        if (folder / f"{name}.py").is_file():
            files.add(folder / f"{name}.py")
            break
        folder = folder / name
        files.add(folder / "__init__.py")
    return {file for file in files if file.is_file()} - {package / name for name in ASIDE}


@cache
def _imports(text: bytes, place: Path) -> tuple[str, ...]:
    """Names of all modules that a source may import, wherever in it; names of their contents among them do no harm.

    ``place`` begins with the package's own folder.
    """
    names: list[str] = []
    for node in ast.walk(ast.parse(text, str(place))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            module = _absolute(node, place)
            names += [module, *(f"{module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Call) and _called(node) in {"import_module", "__import__"}:
            names += _by_name(node, place)
    return tuple(names)


def _absolute(node: ast.ImportFrom, place: Path) -> str:
    if not node.level:
        return node.module or ""
    around = place.parent.parts
    around = around[: len(around) - node.level + 1]
    return ".".join([*around, *([node.module] if node.module else [])])


def _called(node: ast.Call) -> str:
    """``f`` of ``f(...)`` and of ``x.f(...)``."""
    return getattr(node.func, "attr", getattr(node.func, "id", ""))


def _by_name(node: ast.Call, place: Path) -> list[str]:
    """The constant that ``import_module`` is given; the registry alone may compute it, from its own list."""
    name = node.args[0] if node.args else None
    if isinstance(name, ast.Constant) and isinstance(name.value, str):
        return [name.value]
    if place.parts[1:] == COMPUTES_NAMES:
        return []
    raise UnknownImportError(
        f"{place.as_posix()}, line {node.lineno}: imports a module whose name is computed, so the sources that decide "
        "a campaign cannot be told; write the name out"
    )
