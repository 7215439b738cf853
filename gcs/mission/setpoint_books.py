"""What each UAV was told since the books were closed last: counts, gaps and what the gate did."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gcs.ports import SetpointSummary
from gcs.safety.gate import GateAction, SealedSetpoint


@dataclass
class _Page:
    sent: int = 0
    last_s: float = math.nan
    longest_gap_s: float = 0.0
    top_speed_mps: float = 0.0
    slowed: int = 0
    bent: int = 0
    held: int = 0


class SetpointBooks:
    """Filled at every tick, closed at the end of every slot."""

    def __init__(self) -> None:
        self._pages: dict[int, _Page] = {}

    def add(self, sealed: Sequence[SealedSetpoint], now_s: float) -> None:
        """The setpoints of one tick, after the gate."""
        for safe in sealed:
            page = self._pages.setdefault(safe.setpoint.system_id, _Page())
            north_mps, east_mps, _ = safe.setpoint.vel_ned_mps
            page.sent += 1
            if not math.isnan(page.last_s):
                page.longest_gap_s = max(page.longest_gap_s, now_s - page.last_s)
            page.last_s = now_s
            page.top_speed_mps = max(page.top_speed_mps, math.hypot(north_mps, east_mps))
            page.slowed += safe.action is GateAction.SLOWED
            page.bent += safe.action is GateAction.BENT
            page.held += safe.action is GateAction.HELD

    def close(self) -> tuple[SetpointSummary, ...]:
        """One line a UAV that was told anything; the books begin anew, and a gap over this moment still counts."""
        lines = tuple(
            SetpointSummary(
                system_id, page.sent, page.longest_gap_s, page.top_speed_mps, page.slowed, page.bent, page.held
            )
            for system_id, page in sorted(self._pages.items())
            if page.sent
        )
        self._pages = {system_id: _Page(last_s=page.last_s) for system_id, page in self._pages.items()}
        return lines
