"""A radio link between a vehicle and its ground stations: datagrams get lost, late, doubled or cut off."""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np


@dataclass(slots=True)
class Quality:
    """One direction of a link; all zero is a perfect one."""

    loss: float = 0.0  # probability
    delay_s: float = 0.0
    jitter_s: float = 0.0  # standard deviation added to the delay; late ones may overtake
    duplicate: float = 0.0  # probability
    cut: bool = False

    @property
    def perfect(self) -> bool:
        """Whether nothing can happen to a datagram."""
        return not (self.cut or self.loss or self.delay_s or self.jitter_s or self.duplicate)


@dataclass(frozen=True, slots=True, order=True)
class _Waiting:
    due_s: float
    number: int
    peer: int | None = field(compare=False)
    data: bytes = field(compare=False)


class Link:
    """One direction: takes datagrams, gives back those that have arrived."""

    def __init__(self, rng: np.random.Generator) -> None:
        """`rng` decides about losses; the same seed loses the same datagrams."""
        self.quality = Quality()
        self._rng = rng
        self._waiting: list[_Waiting] = []
        self._count = 0

    def put(self, peer: int | None, data: bytes, now_s: float) -> None:
        """Sends a datagram into the link; `peer` None is everybody."""
        quality = self.quality
        if quality.cut or (quality.loss and self._rng.random() < quality.loss):
            return
        copies = 2 if quality.duplicate and self._rng.random() < quality.duplicate else 1
        for _ in range(copies):
            jitter_s = abs(self._rng.normal(0.0, quality.jitter_s)) if quality.jitter_s else 0.0
            self._count += 1
            heapq.heappush(self._waiting, _Waiting(now_s + quality.delay_s + jitter_s, self._count, peer, data))

    def take(self, now_s: float) -> list[tuple[int | None, bytes]]:
        """Datagrams that have arrived by now, oldest first."""
        arrived = []
        while self._waiting and self._waiting[0].due_s <= now_s + 1e-9:
            waiting = heapq.heappop(self._waiting)
            arrived.append((waiting.peer, waiting.data))
        return arrived
