"""The ``gcs`` command: every subcommand is imported when it is asked for."""

import sys
from collections.abc import Sequence

from gcs.cli.errors import OneLineParser


def main(argv: Sequence[str] | None = None) -> int:
    """Exit code 0 on success, 1 when a flight ended early, 2 on a usage or input error."""
    parser = OneLineParser(prog="gcs", description="Ground control of UAV crowdsensing campaigns.")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, parser_class=OneLineParser)
    from gcs.cli.fly import add_fly_parser

    add_fly_parser(commands)
    args = parser.parse_args(argv)
    return int(args.run(args))


if __name__ == "__main__":
    sys.exit(main())
