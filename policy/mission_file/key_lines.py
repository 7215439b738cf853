"""On which line of a TOML text a key stands; ``tomllib`` itself keeps no positions."""

import re
from collections.abc import Iterator

KeyPath = tuple[str | int, ...]
"""Keys and list indices from the top of the document, such as ("area", "obstacles", 0, "height_m")."""

_NAME = r"""(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')"""
_HEADER = re.compile(r"^\s*\[\[?\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$")
_STATEMENT = re.compile(rf"^\s*({_NAME}(?:\s*\.\s*{_NAME})*)\s*=")
_PART = re.compile(_NAME)
_QUOTED = re.compile(r"""\"\"\".*?\"\"\"|'''.*?'''|"(?:\\.|[^"\\])*"|'[^']*'|\#.*""")

_Block = tuple[tuple[str, ...], int, int]  # keys without indices, first and last line (from 1)


def dotted(key: KeyPath) -> str:
    """Readable spelling: ``[area] obstacles[0].height_m``."""
    if len(key) == 1:
        return f"[{key[0]}]"
    rest = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in key[1:])
    return f"[{key[0]}] {rest.lstrip('.')}"


def line_of(text: str, key: KeyPath) -> int | None:
    """Line (from 1) of ``key``, else of the nearest thing around it that is written down, else None."""
    names = tuple(part for part in key if isinstance(part, str))
    index = next((part for part in key if isinstance(part, int)), 0)
    for length in range(len(names), 0, -1):
        blocks = [block for block in _blocks(text) if block[0] == names[:length]]
        if blocks:
            block = blocks[min(index, len(blocks) - 1)]
            return _inside(text, block, names[length:], index) or block[1]
    return None


def _inside(text: str, block: _Block, names: tuple[str, ...], index: int) -> int | None:
    """A key of an inline table: the ``index``-th place within the block where it is given a value."""
    if not names:
        return None
    pattern = re.compile(rf"""(?<![\w-])["']?{re.escape(names[-1])}["']?\s*=""")
    lines = text.splitlines()[block[1] - 1 : block[2]]
    found = [block[1] + number for number, line in enumerate(lines) for _ in pattern.finditer(line)]
    return found[min(index, len(found) - 1)] if found else None


def _blocks(text: str) -> Iterator[_Block]:
    """Every table header and every statement, a value of several lines included."""
    table: tuple[str, ...] = ()
    open_block: tuple[tuple[str, ...], int] | None = None
    depth = 0
    for number, line in enumerate(text.splitlines(), start=1):
        bare = _QUOTED.sub("", line)
        if depth == 0:
            header, statement = _HEADER.match(line), _STATEMENT.match(line)
            if header and not statement:
                table = _names(header.group(1))
                yield table, number, number
                continue
            if not statement:
                continue
            open_block = ((*table, *_names(statement.group(1))), number)
            bare = _QUOTED.sub("", line[statement.end() :])
        depth = max(0, depth + bare.count("[") + bare.count("{") - bare.count("]") - bare.count("}"))
        if depth == 0 and open_block is not None:
            yield (*open_block, number)
            open_block = None


def _names(written: str) -> tuple[str, ...]:
    return tuple(part.strip("\"'") for part in _PART.findall(written))
