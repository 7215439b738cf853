"""Blocks that need no process of their own, run in this one: starting Python is most of what a short command costs.

Words, folder, environment and exit codes are those of a shell. Flights, servers and blocks with programs of others are
left to one.
"""

import io
import os
import re
import shlex
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

from fences import Fence, body_lines

import gcs.__main__
import policy.__main__

PROGRAMS: dict[str, Callable[[Sequence[str]], int]] = {"gcs": gcs.__main__.main, "policy": policy.__main__.main}
WANT_A_PROCESS = ("fly", "serve", "replay", "train", "tables")


@dataclass(frozen=True)
class Line:
    """``PROGRAM WORDS [> FILE] [|| true]``; ``code_matters`` unless the page says that it does not."""

    program: str
    words: tuple[str, ...]
    out: str | None
    code_matters: bool


def lines_of(fence: Fence) -> list[Line] | None:
    """What the block's lines run, None when one of them wants a shell or a process of its own."""
    found = [_line(text) for text in body_lines(fence.body) if text.strip() and not text.startswith("#")]
    return None if None in found else [line for line in found if line is not None]


def run_lines(lines: Sequence[Line], folder: Path, environment: Mapping[str, str]) -> tuple[int, str, str]:
    """Exit code of the first line that failed, else 0; all that was printed on stdout and on stderr."""
    out, err = io.StringIO(), io.StringIO()
    for line in lines:
        into = out if line.out is None else io.StringIO()
        with _as_its_own(folder, environment, into, err):
            code = _exit_code(lambda line=line: PROGRAMS[line.program](line.words))
        if line.out is not None:
            (folder / line.out).write_text(into.getvalue())
        if code and line.code_matters:
            return code, out.getvalue(), err.getvalue()
    return 0, out.getvalue(), err.getvalue()


def run_python(source: str, folder: Path, environment: Mapping[str, str]) -> tuple[int, str, str]:
    """A block of Python as a script of its own."""
    out, err = io.StringIO(), io.StringIO()
    with _as_its_own(folder, environment, out, err):
        code = _exit_code(lambda: exec(compile(source, "<block>", "exec"), {"__name__": "__main__"}))
    return code, out.getvalue(), err.getvalue()


def _line(text: str) -> Line | None:
    match = re.fullmatch(r"(?P<words>[^|&;<>]+?)(?:\s*>\s*(?P<out>[\w.-]+))?(?P<lenient>\s*\|\|\s*true)?\s*", text)
    words = shlex.split(match["words"], comments=True) if match else [""]
    if match is None or "$" in match["words"] or words[0] not in PROGRAMS:
        return None
    if set(words) & set(WANT_A_PROCESS) and "--help" not in words:
        return None
    return Line(words[0], tuple(words[1:]), match["out"], match["lenient"] is None)


@contextmanager
def _as_its_own(folder: Path, environment: Mapping[str, str], out: io.StringIO, err: io.StringIO) -> Iterator[None]:
    before = dict(os.environ)
    with chdir(folder), redirect_stdout(out), redirect_stderr(err):
        os.environ.clear()
        os.environ.update(environment)
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)


def _exit_code(run: Callable[[], object]) -> int:
    """0 as well when nothing is returned; a traceback is printed as Python would."""
    try:
        return int(run() or 0)  # type: ignore[call-overload]
    except SystemExit as ended:
        return int(ended.code or 0)
    except Exception:  # noqa: BLE001 - what a script of its own would print before it ends
        traceback.print_exc()
        return 1
