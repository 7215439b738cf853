"""Shell completion: ``PROGRAM --print-completion bash`` prints a script that the shell sources once.

The script is static, so that completing a word never waits for Python.
"""

import argparse
from collections.abc import Iterator

import shtab

FILES = frozenset({"FILE", "MISSION.toml", "LOG"})
FOLDERS = frozenset({"DIR"})


def add_completion(parser: argparse.ArgumentParser) -> None:
    """The option, and file names where an argument is one. Call it when all arguments are there."""
    shtab.add_argument_to(parser, "--print-completion", help="print a completion script for this shell")
    for action in _actions(parser):
        if action.metavar in FILES:
            action.complete = shtab.FILE  # type: ignore[attr-defined]
        elif action.metavar in FOLDERS:
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    for action in parser._actions:  # noqa: SLF001 - argparse has no other way to its own arguments
        yield action
        if isinstance(action, argparse._SubParsersAction):  # noqa: SLF001
            for below in action.choices.values():
                yield from _actions(below)
