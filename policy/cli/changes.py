"""``--set NAME=VALUE``: one number of a method's settings, under the name that its dataclass gives it."""

import math
from collections.abc import Collection, Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar, get_type_hints

from policy.cli.arguments import CommandError

Settings = TypeVar("Settings")
WORDS = {int: "a whole number", float: "a number"}


def changed(settings: Settings, changes: Sequence[str], keep: Collection[str] = ()) -> Settings:
    """``settings``, a frozen dataclass, with each ``NAME=VALUE`` of ``changes`` in place of what it has.

    Only its numbers can be changed, and of these none of ``keep``, for which the command has an option. Raises
    CommandError that lists the names for one that is unknown, and says what is wrong with a value.
    """
    kinds = _numbers(settings, keep)
    found: dict[str, Any] = {}
    for change in changes:
        name, equals, text = change.partition("=")
        if not equals:
            raise CommandError(f"--set {change[:60]}: must be NAME=VALUE, such as --set {_example(settings, kinds)}")
        if name not in kinds:
            raise CommandError(f"--set {name[:40]}: no such setting; choose one of: {', '.join(sorted(kinds))}")
        if name in found:
            raise CommandError(f"--set {name}: given twice; leave one of them out")
        found[name] = _read(name, text, kinds[name])
    try:
        return replace(settings, **found)  # type: ignore[type-var]
    except ValueError as error:
        raise CommandError(f"--set: {error}") from error


def _numbers(settings: Any, keep: Collection[str]) -> dict[str, type]:
    hints = get_type_hints(type(settings))
    names = [field.name for field in fields(settings) if field.name not in keep]
    return {name: hints[name] for name in names if hints[name] in WORDS}


def _example(settings: Any, kinds: dict[str, type]) -> str:
    name = min(kinds)
    return f"{name}={getattr(settings, name)}"


def _read(name: str, text: str, kind: type) -> Any:
    try:
        value = kind(text)
    except ValueError as error:
        raise CommandError(f"--set {name}: {text[:40]!r} is not {WORDS[kind]}") from error
    if not math.isfinite(value):
        raise CommandError(f"--set {name}: {text[:40]} is not finite")
    return value
