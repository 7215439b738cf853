"""Every way to one vehicle, each with its own loss and latency; one of them counts, the others stand by.

A slow second link must not bring an old mode back: what is heard there proves that the vehicle lives and answers
orders, nothing else, as long as the first one is alive. Loss is counted a link: over merged links it is wrong
(https://mavlink.io/en/guide/packet_loss.html).
"""

from dataclasses import dataclass, field

from gcs.links.latency import LatencyMeter
from gcs.links.loss import LossMeter
from gcs.links.wire import Path
from gcs.ports import LinkQuality

SILENT_S = 1.5  # nothing heard for so long on the first link: the next one counts
FORGOTTEN_S = 60.0  # a path unheard for so long is not tried any more
CLOCKS_APART_S = 5.0  # two vehicles with one id have been up for different times


@dataclass
class Route:
    """One way."""

    path: Path
    heard_s: float
    loss: LossMeter = field(default_factory=LossMeter)
    latency: LatencyMeter = field(default_factory=LatencyMeter)
    boot_offset_s: float | None = None  # our clock less the vehicle's time since boot


class Routes:
    """All ways to one vehicle."""

    def __init__(self) -> None:
        self._routes: dict[Path, Route] = {}
        self._primary: Route | None = None

    def find(self, path: Path) -> Route | None:
        """The route over ``path``, if it is one."""
        return self._routes.get(path)

    def add(self, path: Path, now_s: float) -> Route:
        """A new way."""
        route = self._routes[path] = Route(path, now_s)
        self._primary = self._primary or route
        return route

    def move(self, path: Path, now_s: float) -> Route:
        """The vehicle is heard there now and nowhere else."""
        self._routes.clear()
        self._primary = None
        return self.add(path, now_s)

    def heard_elsewhere(self, path: Path, now_s: float, within_s: float) -> Route | None:
        """Another way on which it has been heard lately."""
        others = (route for route in self._routes.values() if route.path != path)
        return next((route for route in others if now_s - route.heard_s < within_s), None)

    def note(self, path: Path, sequence: int | None, now_s: float) -> bool:
        """Something was heard on a known path; True when what it says counts."""
        route = self._routes[path]
        route.heard_s = now_s
        if sequence is not None:
            route.loss.on_sequence(sequence)
        if self._primary is None or now_s - self._primary.heard_s > SILENT_S:
            self._primary = route
        return self._primary is route

    def other_vehicle(self, path: Path, boot_s: float, now_s: float) -> bool:
        """Its time since boot does not fit what another live path says: two vehicles use one system id."""
        route = self._routes[path]
        offset_s = now_s - boot_s
        known_s = route.boot_offset_s
        route.boot_offset_s = offset_s if known_s is None or abs(offset_s - known_s) > CLOCKS_APART_S else known_s
        return any(
            other is not route
            and other.boot_offset_s is not None
            and now_s - other.heard_s < SILENT_S
            and abs(other.boot_offset_s - offset_s) > CLOCKS_APART_S
            for other in self._routes.values()
        )

    def is_strange(self, boot_s: float, now_s: float) -> bool:
        """What was up for so long is not the vehicle that is known here: its time since boot fits none of its ways."""
        known_s = [route.boot_offset_s for route in self._routes.values() if route.boot_offset_s is not None]
        return bool(known_s) and all(abs(now_s - boot_s - offset_s) > CLOCKS_APART_S for offset_s in known_s)

    def usual(self, now_s: float) -> list[Path]:
        """Where to send: the first link, or every one while it is silent."""
        if self._primary is not None and now_s - self._primary.heard_s <= SILENT_S:
            return [self._primary.path]
        return self.every(now_s)

    def every(self, now_s: float) -> list[Path]:
        """All ways that may still work; all of them when none has been heard lately."""
        lately = [route.path for route in self._routes.values() if now_s - route.heard_s < FORGOTTEN_S]
        return lately or list(self._routes)

    def all(self) -> list[Route]:
        """Each way, the one in use first."""
        return sorted(self._routes.values(), key=lambda route: route is not self._primary)

    def qualities(self) -> tuple[LinkQuality, ...]:
        """For operators."""
        return tuple(
            LinkQuality(r.path.address, r.loss.ratio, r.latency.latency_s, r.heard_s, r is self._primary)
            for r in self.all()
        )
