"""``PROGRAM --version``."""

import argparse
from importlib.metadata import PackageNotFoundError, version

PACKAGE = "uav-crowdsensing"


def add_version(parser: argparse.ArgumentParser) -> None:
    """The option; from a checkout that is not installed nobody knows the version."""
    try:
        found = version(PACKAGE)
    except PackageNotFoundError:
        found = "unknown"
    parser.add_argument("--version", action="version", version=f"%(prog)s {found}")
