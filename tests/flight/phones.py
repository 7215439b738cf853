"""A simulator of phones: people who walk, with clocks that are wrong and links that come and go.

Each phone knows the truth of where it is; what the server gets is late, in batches, out of order, twice, and stamped by
a wrong clock. ``truth`` says what a server that gets it right must know in the end.
"""

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any

from policy.world.frames import LocalFrame

Send = Callable[[str, list[dict[str, Any]]], None]
"""fixes, uploads or departures, and the reports: over REST or over the WebSocket."""


@dataclass
class Phone:
    """One person, walking in a straight line from ``joins_s`` to ``leaves_s``."""

    user: str
    start_m: tuple[float, float]
    speed_mps: tuple[float, float]
    skew_s: float = 0.0  # the phone's clock less the true one
    joins_s: float = 0.0
    leaves_s: float = float("inf")
    tells: bool = False  # sends receipts
    waiting: list[dict[str, Any]] = field(default_factory=list)  # fixes that have not been sent
    sent: list[dict[str, Any]] = field(default_factory=list)

    def place_m(self, now_s: float) -> tuple[float, float]:
        """Where he is."""
        walked_s = min(now_s, self.leaves_s) - self.joins_s
        return (self.start_m[0] + self.speed_mps[0] * walked_s, self.start_m[1] + self.speed_mps[1] * walked_s)

    def present(self, now_s: float) -> bool:
        """Takes part."""
        return self.joins_s <= now_s < self.leaves_s


class Crowd:
    """Phones on one virtual clock that begins at ``begun`` of the server's."""

    def __init__(self, phones: list[Phone], frame: LocalFrame, begun: datetime, seed: int = 0) -> None:
        self.phones, self._frame, self._begun = phones, frame, begun
        self._draw = random.Random(seed)
        self._gone: set[str] = set()

    def moment(self, phone: Phone, now_s: float) -> str:
        """By the phone's own clock."""
        return (self._begun + timedelta(seconds=now_s + phone.skew_s)).isoformat()

    def measure(self, now_s: float) -> None:
        """Every phone that is on notes where it is."""
        for phone in self.phones:
            if phone.present(now_s):
                lat_deg, lon_deg = self._frame.to_geodetic_deg(*phone.place_m(now_s))
                fix = {"user": phone.user, "lat_deg": float(lat_deg), "lon_deg": float(lon_deg)}
                phone.waiting.append(fix | {"time": self.moment(phone, now_s)})

    def send(self, now_s: float, send: Send, *, covered: float = 0.7) -> None:
        """Phones that have a network now send what waits: shuffled, in batches, some of it twice, some old again."""
        batch: list[dict[str, Any]] = []
        for phone in self.phones:
            if self._draw.random() < covered and phone.waiting:
                batch += phone.waiting
                batch += self._draw.sample(phone.waiting, self._draw.randint(0, len(phone.waiting)))
                batch += self._draw.sample(phone.sent, min(2, len(phone.sent)))
                phone.sent += phone.waiting
                phone.waiting = []
        self._draw.shuffle(batch)
        for part in _parts(batch, self._draw.randint(1, 7)):
            send("fixes", part)
        self._say_goodbye(now_s, send)

    def receipt(self, phone: Phone, now_s: float, send: Send) -> None:
        """His data arrived; the app says it twice, to be sure."""
        one = {"user": phone.user, "time": self.moment(phone, now_s), "uploaded_mb": 0.3}
        send("uploads", [one, one])
        send("uploads", [one])

    def catch_up(self, now_s: float, send: Send) -> None:
        """Everybody has a network."""
        self.send(now_s, send, covered=1.1)

    def _say_goodbye(self, now_s: float, send: Send) -> None:
        for phone in self.phones:
            if now_s >= phone.leaves_s and phone.user not in self._gone and not phone.waiting:
                self._gone.add(phone.user)
                send("departures", [{"user": phone.user, "time": self.moment(phone, phone.leaves_s)}] * 2)


def _parts(batch: list[dict[str, Any]], size: int) -> Iterator[list[dict[str, Any]]]:
    for begin in range(0, len(batch), size):
        yield batch[begin : begin + size]
