"""The ``gcs`` command."""

import argparse
import importlib
import sys
from collections.abc import Sequence

from gcs.cli.errors import OneLineParser
from policy.cli.completion import add_completion

COMMANDS = {
    "fly": ("gcs.cli.fly", "add_fly_parser"),
    "serve": ("gcs.cli.serve", "add_serve_parser"),
    "replay": ("gcs.cli.replay", "add_replay_parser"),
    "keys": ("gcs.cli.keys", "add_keys_parser"),
    "audit": ("gcs.cli.audit", "add_audit_parser"),
    "recheck": ("gcs.cli.recheck", "add_recheck_parser"),
    "places": ("gcs.cli.places", "add_places_parser"),
    "doctor": ("gcs.cli.doctor", "add_doctor_parser"),
    "openapi": ("gcs.cli.openapi", "add_openapi_parser"),
}
"""Subcommand -> module and the function that adds its parser. A module is imported only for its own command."""


def parser(words: Sequence[str] = ()) -> argparse.ArgumentParser:
    """With the subcommand that ``words`` begin with, or else with all of them."""
    options = OneLineParser(prog="gcs", description="Ground control of UAV crowdsensing campaigns.")
    commands = options.add_subparsers(metavar="COMMAND", required=True, parser_class=OneLineParser)
    wanted = [words[0]] if words and words[0] in COMMANDS else list(COMMANDS)
    for name in wanted:
        module, adder = COMMANDS[name]
        getattr(importlib.import_module(module), adder)(commands)
    add_completion(options)
    return options


def main(argv: Sequence[str] | None = None) -> int:
    """Exit code 0 on success, 1 when a flight ended early, 2 on a usage or input error."""
    words = list(sys.argv[1:] if argv is None else argv)
    args = parser(words).parse_args(words)
    return int(args.run(args))


if __name__ == "__main__":
    sys.exit(main())
