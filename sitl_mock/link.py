"""A radio link between a vehicle and its ground stations: datagrams get lost, late, doubled, garbled or cut off."""

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
    burst_loss: float = 0.0  # share of the time that the link is in a bad spell, in which all is lost
    delay_s: float = 0.0
    jitter_s: float = 0.0  # standard deviation added to the delay; late ones may overtake
    duplicate: float = 0.0  # probability
    reorder: float = 0.0  # probability of being held back until later ones have passed
    corrupt: float = 0.0  # probability that a few bytes are changed
    cut: bool = False

    @property
    def perfect(self) -> bool:
        """Whether nothing can happen to a datagram."""
        return self == _PERFECT


_PERFECT = Quality()
MEAN_BURST_S = 1.0  # a spell of burst loss lasts this long on average
REORDER_S = 0.2  # how long a datagram is held back
_MAX_FLIPS = 4


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
        self._bad_spell = False
        self._spell_ends_s = -1.0

    def _chance(self, probability: float) -> bool:
        return probability > 0.0 and bool(self._rng.random() < probability)

    def _in_bad_spell(self, share: float, now_s: float) -> bool:
        """Gilbert's model in time: good and bad spells of random length, bad for `share` of the time."""
        if share <= 0.0:
            self._spell_ends_s, self._bad_spell = -1.0, False
            return False
        if self._spell_ends_s < 0.0:
            self._spell_ends_s = now_s
            self._bad_spell = not self._chance(share)
        while self._spell_ends_s <= now_s:
            self._bad_spell = not self._bad_spell
            mean_s = MEAN_BURST_S if self._bad_spell else MEAN_BURST_S * (1.0 - share) / share
            self._spell_ends_s += max(float(self._rng.exponential(mean_s)), 1e-3)
        return self._bad_spell

    def _garbled(self, data: bytes) -> bytes:
        changed = bytearray(data)
        for _ in range(int(self._rng.integers(1, _MAX_FLIPS + 1))):
            changed[int(self._rng.integers(len(changed)))] ^= int(self._rng.integers(1, 256))
        return bytes(changed)

    def put(self, peer: int | None, data: bytes, now_s: float) -> None:
        """Sends a datagram into the link; `peer` None is everybody."""
        quality = self.quality
        if quality.cut or self._chance(quality.loss) or self._in_bad_spell(quality.burst_loss, now_s):
            return
        copies = 2 if self._chance(quality.duplicate) else 1
        for _ in range(copies):
            jitter_s = abs(self._rng.normal(0.0, quality.jitter_s)) if quality.jitter_s else 0.0
            held_s = REORDER_S if self._chance(quality.reorder) else 0.0
            arrived = self._garbled(data) if data and self._chance(quality.corrupt) else data
            self._count += 1
            due_s = now_s + quality.delay_s + jitter_s + held_s
            heapq.heappush(self._waiting, _Waiting(due_s, self._count, peer, arrived))

    @property
    def empty(self) -> bool:
        """Whether nothing is on its way."""
        return not self._waiting

    def take(self, now_s: float) -> list[tuple[int | None, bytes]]:
        """Datagrams that have arrived by now, oldest first."""
        arrived = []
        while self._waiting and self._waiting[0].due_s <= now_s + 1e-9:
            waiting = heapq.heappop(self._waiting)
            arrived.append((waiting.peer, waiting.data))
        return arrived
