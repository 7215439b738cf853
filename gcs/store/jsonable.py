"""Values of the flight as JSON that every database takes: no NaN, no NUL, no half of a surrogate pair."""

import math
from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np

_AS_THEY_ARE = frozenset({int, bool, type(None)})


def clean_text(text: str) -> str:
    """``text`` without what PostgreSQL or UTF-8 refuse: vehicles put any bytes into STATUSTEXT."""
    if type(text) is str and text.isascii() and "\x00" not in text:
        return text
    return text.replace("\x00", "�").encode("utf-8", "replace").decode("utf-8")


def jsonable(value: Any) -> Any:
    """Plain lists, dicts, numbers and strings; a number that is none becomes None, the unknown its text."""
    kind = type(value)  # the plain ones first: thousands of numbers a slot, while the flight waits for the store
    if kind is float:
        return value if math.isfinite(value) else None
    if kind in _AS_THEY_ARE:
        return value
    if kind is tuple or kind is list:
        return [jsonable(item) for item in value]
    return _unusual(value)


def _unusual(value: Any) -> Any:
    match value:
        case Enum():
            return jsonable(value.value)
        case np.ndarray() | np.generic():
            return jsonable(value.tolist())
        case Mapping():
            return {clean_text(str(key)): jsonable(item) for key, item in value.items()}
        case list() | tuple() | set() | frozenset():
            return [jsonable(item) for item in value]
    return _scalar(value)


def _scalar(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int) else clean_text(str(value))
