"""Which moments of a flight are kept for looking back: one a second at first, fewer when a flight is long or large."""

from collections.abc import Mapping

from gcs.mission.campaign import Campaign
from gcs.mission.states import IN_FLIGHT
from gcs.ports import Journal, TelemetrySample, VehicleStatus

PERIOD_S = 1.0
TOLERANCE_S = 1e-3  # ticks are sums of tenths
BUDGET = 200_000  # vehicles' rows (some 35 MB) until the period doubles: 55 minutes of 60 drones, a day of 2


class TelemetrySampler:
    """Called by the flight loop at the end of each tick; hands frozen values on and computes nothing."""

    def __init__(self, journal: Journal, period_s: float = PERIOD_S, budget: int = BUDGET) -> None:
        self._journal, self._first_period_s, self._budget = journal, period_s, budget
        self._campaign_id = ""  # that is being sampled
        self._period_s, self._next_s, self._rows = period_s, 0.0, 0

    def tick(self, campaign: Campaign | None, vehicles: Mapping[int, VehicleStatus], now_s: float) -> None:
        """Keep this moment when it is due; the last one of a campaign shows how everybody stands."""
        if campaign is None:
            return
        campaign_id, flying = campaign.order.campaign_id, campaign.state in IN_FLIGHT
        if flying and campaign_id != self._campaign_id:
            self._campaign_id = campaign_id
            self._period_s, self._next_s, self._rows = self._first_period_s, now_s, 0
        if campaign_id != self._campaign_id or (flying and now_s < self._next_s - TOLERANCE_S):
            return
        self._journal.record_telemetry(campaign_id, TelemetrySample(now_s, tuple(vehicles.values())))
        self._campaign_id = campaign_id if flying else ""
        self._rows += len(vehicles)
        if self._rows >= self._budget:
            self._period_s, self._rows = 2.0 * self._period_s, 0
        self._next_s = max(self._next_s + self._period_s, now_s)
