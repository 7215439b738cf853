"""Command-line conduct: a usage error is one line on stderr and exit code 2."""

import argparse
import math
import sys
from collections.abc import Callable
from typing import NoReturn

USAGE_ERROR = 2


class CommandError(ValueError):
    """What was asked for cannot be done as asked: one line."""


class Parser(argparse.ArgumentParser):
    """argparse without the usage text before each error: ``--help`` has it."""

    def error(self, message: str) -> NoReturn:
        """One line, exit 2."""
        print(f"{self.prog}: {' '.join(message.split())} (see {self.prog} --help)", file=sys.stderr)
        raise SystemExit(USAGE_ERROR)


def whole(low: int, high: int) -> Callable[[str], int]:
    """A converter for ``type=``: an integer in [low, high]."""

    def convert(text: str) -> int:
        try:
            value = int(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(f"{text[:40]!r} is no whole number") from error
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text[:40]} is not between {low} and {high}")
        return value

    return convert


def number(low: float, high: float) -> Callable[[str], float]:
    """A converter for ``type=``: a finite number in [low, high]."""

    def convert(text: str) -> float:
        try:
            value = float(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(f"{text[:40]!r} is no number") from error
        if not (math.isfinite(value) and low <= value <= high):
            raise argparse.ArgumentTypeError(f"{text[:40]} is not between {low:g} and {high:g}")
        return value

    return convert
