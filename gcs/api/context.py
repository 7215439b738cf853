"""What every route needs, handed over once by the factory."""

from dataclasses import dataclass, field
from typing import Annotated, Any

from anyio import CapacityLimiter
from fastapi import Depends, Request

from gcs.api.auth import Actor, actor_of
from gcs.api.catalog import Catalog
from gcs.api.live_users import LiveCampaigns
from gcs.api.remembered import Remembered
from gcs.api.settings import ApiSettings
from gcs.forecast.dry_runs import DryRuns
from gcs.ports import Event, FlightControl, Severity
from gcs.store.store import Store

ORDER_WORKERS = 4  # orders never queue behind requests that wait for a store
STREAM_WORKERS = 1  # what is said of a tick is made once and shared: a second one would only wait for it


@dataclass(frozen=True)
class ApiContext:
    """The flight, the records, and what the API keeps between requests."""

    control: FlightControl
    store: Store
    settings: ApiSettings
    live: LiveCampaigns
    catalog: Catalog = field(init=False)
    remembered: Remembered = field(init=False)
    dry_runs: DryRuns = field(default_factory=DryRuns)
    order_workers: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(ORDER_WORKERS))
    stream_workers: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(STREAM_WORKERS))

    def __post_init__(self) -> None:
        object.__setattr__(self, "catalog", Catalog(self.store.campaigns))
        object.__setattr__(self, "remembered", Remembered(lambda: self.store.commits.count))

    def audit(self, actor: str, kind: str, message: str, *, severity: Severity = Severity.INFO, **where: Any) -> None:
        """Who asked for what stands in the log before anything comes of it."""
        time_s = self.control.snapshot().time_s
        self.store.journal.record(Event(time_s, kind, message, severity, actor=actor, **where))


def _context(request: Request) -> ApiContext:
    context: ApiContext = request.app.state.context
    return context


def _actor(request: Request) -> Actor:
    return actor_of(request.scope)


Context = Annotated[ApiContext, Depends(_context)]
Who = Annotated[Actor, Depends(_actor)]
