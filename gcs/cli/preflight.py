"""The checklist of ``gcs fly``: wait until nothing is red, tell what is worth knowing, refuse what stays red."""

from collections.abc import Callable

from gcs.cli.errors import UsageError
from gcs.flight_loop import FlightLoop
from gcs.mission.order import CampaignOrder
from gcs.mission.preflight import Grade, Line, red_lines
from gcs.ports import FlightSnapshot


def preflight(loop: FlightLoop, order: CampaignOrder, tell: Callable[[str], None]) -> tuple[Line, ...]:
    """All lines; raises UsageError with the red ones when they stay so for the time that drones have to get ready."""
    begun_s = loop.snapshot().time_s
    found: list[tuple[Line, ...]] = []

    def settled(snapshot: FlightSnapshot) -> bool:
        lines = loop.preflight(order, snapshot.time_s)
        done = not red_lines(lines) or snapshot.time_s - begun_s > order.settings.ready_timeout_s
        if done:
            found.append(lines)
        return done

    loop.run(until=settled)
    if not found:
        return ()
    red = red_lines(found[0])
    if red:
        raise UsageError("pre-flight: " + "; ".join(line.words() for line in red))
    for line in found[0]:
        if line.grade is Grade.CAUTION:
            tell(f"pre-flight caution: {line.words()}")
    tell(f"pre-flight: {len(found[0])} checks of {len(order.system_ids)} drones, none red")
    return found[0]
