"""The ``gcs`` command."""

import argparse
import importlib
import sys
from collections.abc import Sequence

from gcs.cli.errors import OneLineParser
from policy.cli.completion import add_completion
from policy.cli.version import add_version

COMMANDS = {
    "fly": ("gcs.cli.fly", "add_fly_parser", "fly one campaign"),
    "serve": ("gcs.cli.serve", "add_serve_parser", "the server: REST, WebSocket, operator page"),
    "replay": ("gcs.cli.replay", "add_replay_parser", "show a recorded campaign on the page"),
    "keys": ("gcs.cli.keys", "add_keys_parser", "API keys: add, list, revoke"),
    "audit": ("gcs.cli.audit", "add_audit_parser", "check the audit log's hash chain"),
    "recheck": ("gcs.cli.recheck", "add_recheck_parser", "make a recorded campaign's decisions again and compare"),
    "places": ("gcs.cli.places", "add_places_parser", "wipe where the users of campaigns were"),
    "doctor": ("gcs.cli.doctor", "add_doctor_parser", "is this machine fit to fly from?"),
    "openapi": ("gcs.cli.openapi", "add_openapi_parser", "print the API's OpenAPI document"),
}
"""Subcommand -> module, the function that adds its parser, its line of ``gcs --help``. A module is imported only for
its own command: all of them together take seconds."""


def parser(words: Sequence[str] = ()) -> argparse.ArgumentParser:
    """With the subcommand that ``words`` begin with, or else with all of them."""
    options, commands = _program()
    for name in [words[0]] if words and words[0] in COMMANDS else list(COMMANDS):
        module, adder, _ = COMMANDS[name]
        getattr(importlib.import_module(module), adder)(commands)
    add_completion(options)
    return options


def outline() -> argparse.ArgumentParser:
    """What ``gcs --help``, ``gcs --version`` and a word that is no subcommand need: subcommands without options."""
    options, commands = _program()
    for name, (_, _, words) in COMMANDS.items():
        commands.add_parser(name, help=words)
    add_completion(options)
    return options


def main(argv: Sequence[str] | None = None) -> int:
    """Exit code 0 on success, 1 when a flight ended early, 2 on a usage or input error."""
    words = list(sys.argv[1:] if argv is None else argv)
    whole = words[:1] and (words[0] in COMMANDS or words[0].startswith("--p"))  # --print-completion needs every option
    args = (parser(words) if whole else outline()).parse_args(words)
    return int(args.run(args))


def _program() -> tuple[argparse.ArgumentParser, "argparse._SubParsersAction[OneLineParser]"]:
    options = OneLineParser(prog="gcs", description="Ground control of UAV crowdsensing campaigns.")
    add_version(options)
    return options, options.add_subparsers(metavar="COMMAND", required=True, parser_class=OneLineParser)


if __name__ == "__main__":
    sys.exit(main())
