"""Operator mistakes on the command line: one line, exit code 2."""

import argparse
import sys
from typing import NoReturn


class UsageError(ValueError):
    """What is wrong, where, and how to mend it, in one line."""


class OneLineParser(argparse.ArgumentParser):
    """argparse without its usage block: errors are one line on stderr."""

    def error(self, message: str) -> NoReturn:
        """Exit 2."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def complain(program: str, error: Exception) -> int:
    """Print the error as one line; the exit code of an input error."""
    text = " ".join(str(error).split()) or type(error).__name__
    print(f"{program}: {text}", file=sys.stderr)
    return 2
