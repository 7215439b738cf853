"""``python -m policy``: evaluate, train, tabulate and serve policies."""

import os
import sys
from collections.abc import Sequence

from policy.agents.registry import UnknownPolicyError
from policy.cli import evaluate, serve, tables, train
from policy.cli.arguments import USAGE_ERROR, CommandError, Parser
from policy.cli.completion import add_completion
from policy.cli.version import add_version
from policy.evaluation.files import OutputError
from policy.mission_file import MissionError
from policy.model.checkpoint_error import CheckpointError

INTERRUPTED = 130


def parser() -> Parser:
    """All commands."""
    options = Parser(prog="policy", description="Evaluate, train and serve policies of UAV crowdsensing missions.")
    add_version(options)
    commands = options.add_subparsers(metavar="COMMAND", required=True, parser_class=Parser)
    for command in (evaluate, train, tables, serve):
        command.add_parser(commands)
    add_completion(options)
    return options


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Exit codes: 0 done, 2 usage or input error (one line on stderr), 130 interrupted."""
    options = parser().parse_args(arguments)
    try:
        options.run(options)
    except (MissionError, UnknownPolicyError, CheckpointError, OutputError, CommandError) as error:
        print(f"policy: {' '.join(str(error).split())}", file=sys.stderr)
        return USAGE_ERROR
    except KeyboardInterrupt:
        print("policy: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output went away, as in `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
