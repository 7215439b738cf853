"""`make bench`: measures and writes one Markdown page. Whole flights, single-threaded decisions, wire-side periods.

Every figure is a median of several runs; compare figures of one run with each other, not with another machine's.
"""

import argparse
import platform
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from autopilots import mock_speed
from decisions import decision_times
from fleet_cost import fleet_cost
from flights import campaign_wall_times
from load import load
from setpoints import setpoint_periods
from stepping import steps_per_second

Row = tuple[str, str, str]
SECTIONS: dict[str, tuple[str, Callable[[bool], list[Row]]]] = {
    "decisions": ("Decision time, one thread, 92 users, ideal motion", decision_times),
    "stepping": ("Environment steps per second, one thread", steps_per_second),
    "mock": ("The mock autopilot, CPU time on one thread", mock_speed),
    "flights": ("A campaign over MAVLink sockets, as fast as the machine allows", campaign_wall_times),
    "setpoints": ("Setpoint period on the wire while the API serves 200 requests/s", setpoint_periods),
    "fleet": ("What a hundred vehicles cost the server by part, CPU time on one thread", fleet_cost),
    "load": ("100 drones at 50 messages/s, 20 pages, 200 requests/s on one server", load),
}


def main() -> None:
    """Measure the sections asked for and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="Markdown file to write; without it the table goes to stdout")
    parser.add_argument("--only", choices=SECTIONS, action="append", help="measure only this section; may be repeated")
    parser.add_argument("--quick", action="store_true", help="fewer repeats")
    args = parser.parse_args()
    parts = [_head()]
    for name in args.only or SECTIONS:
        title, measure = SECTIONS[name]
        print(f"measuring: {title}", file=sys.stderr, flush=True)
        parts.append(_section(title, measure(args.quick)))
    text = "\n".join(parts)
    if args.out is None:
        print(text)
    else:
        args.out.write_text(text, encoding="utf-8")


def _head() -> str:
    now = datetime.now(UTC).date().isoformat()
    return (
        "# Bench\n\nWritten by `make bench`"
        f" on {now}, {platform.machine()}, Python {platform.python_version()}. Medians, with the range in brackets.\n"
    )


def _section(title: str, rows: list[Row]) -> str:
    lines = [f"## {title}\n", "| what | figure | unit |", "| --- | --- | --- |"]
    lines += [f"| {what} | {figure} | {unit} |" for what, figure, unit in rows]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
