"""``policy serve``: the policy as its own HTTP service, POST /v1/act."""

import argparse

from policy.agents.registry import LEARNED, PolicyChoice, check_name, policy_names
from policy.cli.arguments import CommandError, whole


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """The command's arguments."""
    parser = commands.add_parser("serve", help="serve decisions over HTTP", description=__doc__)
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (default: %(default)s)")
    parser.add_argument("--port", type=whole(0, 65_535), default=8090, help="0: any free one (default: %(default)s)")
    parser.add_argument("--policy", metavar="NAME", help=f"for requests that name none: {', '.join(policy_names())}")
    parser.add_argument("--checkpoint", metavar="FILE", help="trained weights for --policy (default: the shipped ones)")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Serve until interrupted."""
    from policy.service.server import ServerError, serve  # noqa: PLC0415 - the web stack is for this command only

    if options.checkpoint is not None and options.policy not in LEARNED:
        raise CommandError(f"--checkpoint needs --policy with a method that learns: {', '.join(sorted(LEARNED))}")
    choice = None
    if options.policy is not None:
        check_name(options.policy)
        choice = PolicyChoice(options.policy, options.checkpoint)
        choice.build()  # a checkpoint that cannot be read is found out now, not at the first request
    try:
        serve(options.host, options.port, choice)
    except ServerError as error:
        raise CommandError(str(error)) from error
