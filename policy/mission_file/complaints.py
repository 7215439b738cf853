"""Turns what the schema rejects into one line that names the key, the value and the way out."""

import difflib
import inspect
from typing import Any, NoReturn, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from policy.mission_file.key_lines import KeyPath
from policy.mission_file.mission import Source
from policy.mission_file.schema import MissionDocument


def complain(error: ValidationError, source: Source) -> NoReturn:
    """Raise the first fault (unknown keys before all others: they are what explains a missing one)."""
    faults = error.errors(include_url=False)
    first = min(faults, key=lambda fault: fault["type"] != "extra_forbidden")
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    key = tuple(part for part in first["loc"] if isinstance(part, str | int))
    source.fail(key, _message(first, key) + more)


def suggestion(word: str, known: list[str]) -> str:
    """``; did you mean "slot_s"?``, or what is known when nothing is near."""
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    return f'; did you mean "{near[0]}"?' if near else f"; known: {', '.join(sorted(known))}"


def shown(value: object) -> str:
    """A short spelling of a wrong value; never the whole of a large one."""
    if isinstance(value, bool | float) or (isinstance(value, int) and value.bit_length() < 200):
        return repr(value)
    if isinstance(value, str):
        return repr(value if len(value) <= 40 else value[:37] + "...")
    return {int: "a huge number", list: "a list", dict: "a table"}.get(type(value), f"a {type(value).__name__}")


def _message(fault: ErrorDetails, key: KeyPath) -> str:
    if fault["type"] == "extra_forbidden":
        kind = "section" if len(key) == 1 else "key"
        return f"unknown {kind}" + suggestion(str(key[-1]), _siblings(key))
    if fault["type"] == "missing":
        return f"{'section' if len(key) == 1 else 'key'} is missing; add it"
    text = fault["msg"].replace("Input should", "should")
    return f"{text}, not {shown(fault['input'])}"


def _siblings(key: KeyPath) -> list[str]:
    """Names that are known beside the unknown last part of ``key``."""
    model: type[BaseModel] = MissionDocument
    for part in key[:-1]:
        if isinstance(part, str):
            model = _model_in(model.model_fields[part].annotation) or model
    return list(model.model_fields)


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The section inside ``list[Section]`` and the like."""
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for arg in get_args(annotation) if (found := _model_in(arg))), None)
