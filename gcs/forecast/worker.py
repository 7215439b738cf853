"""``python -m gcs.forecast.worker``: one dry run in a process of its own, behind the flight's in the queue for the CPU.

Reads one line of JSON (a DryRunOrder), writes a line a slot and one with the forecast or with the reason why there is
none. Ends when its standard input closes, so that it never outlives the server that started it.
"""

import json
import os
import sys
import threading
from typing import Any

from gcs.forecast.estimate import DryRunOrder, estimate
from policy.agents.registry import UnknownPolicyError
from policy.mission_file import MissionError
from policy.model.checkpoint_error import CheckpointError

NICENESS = 10


def main() -> int:
    """0 with a forecast or a reason; anything else is a defect, with its traceback on stderr."""
    os.nice(NICENESS)
    order = DryRunOrder(**json.loads(sys.stdin.readline()))
    threading.Thread(target=_end_with_the_server, daemon=True).start()
    try:
        say({"done": estimate(order, lambda: say({"slot": 1}))})
    except (MissionError, UnknownPolicyError, CheckpointError) as error:
        say({"failed": str(error)})
    return 0


def say(message: dict[str, Any]) -> None:
    """One line to the server."""
    print(json.dumps(message, allow_nan=False), flush=True)


def _end_with_the_server() -> None:
    while os.read(0, 1):  # below Python's own buffer, whose lock would be held when the interpreter ends
        pass
    os._exit(0)


if __name__ == "__main__":
    sys.exit(main())
