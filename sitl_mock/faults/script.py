"""The course of a run's faults: who suffers what at a time."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from math import isfinite

from sitl_mock.faults.fault import Effects, Fault
from sitl_mock.faults.kinds import KINDS


@dataclass(frozen=True, slots=True)
class Change:
    """At this moment vehicle `index` suffers `effects`; `strikes` happen to it once, now."""

    index: int
    effects: Effects
    strikes: tuple[Fault, ...]


class Script:
    """Starts and ends faults as time passes; more can be added while it runs."""

    def __init__(self, faults: list[Fault], vehicles: int) -> None:
        """`faults` in any order."""
        self._vehicles = vehicles
        self._events: list[tuple[float, int, int]] = []  # time, 0 end or 1 begin, number of the fault
        self._faults: dict[int, Fault] = {}
        self._active: dict[int, Fault] = {}  # in the order in which they began
        self._count = 0
        self._touched = False
        for fault in faults:
            self.add(fault)

    def add(self, fault: Fault) -> int:
        """Puts a fault on the list, returns its number."""
        self._count += 1
        self._faults[self._count] = fault
        heapq.heappush(self._events, (fault.at_s, 1, self._count))
        if isfinite(fault.for_s):
            heapq.heappush(self._events, (fault.at_s + fault.for_s, 0, self._count))
        return self._count

    def remove(self, number: int) -> bool:
        """Takes a fault off the list, ends it if it is on; False if there is none of that number."""
        if self._faults.pop(number, None) is None:
            return False
        self._touched = self._active.pop(number, None) is not None or self._touched
        return True

    @property
    def faults(self) -> dict[int, tuple[Fault, bool]]:
        """All that are not over, by number, with whether they are on now."""
        return {number: (fault, number in self._active) for number, fault in self._faults.items()}

    def advance(self, now_s: float) -> list[Change]:
        """What changes now, for every vehicle; nothing as long as no fault begins or ends."""
        strikes: list[Fault] = []
        while self._events and self._events[0][0] <= now_s + 1e-9:
            _, begins, number = heapq.heappop(self._events)
            fault = self._faults.get(number)
            if fault is None:
                continue
            self._touched = True
            if not begins:
                del self._active[number], self._faults[number]
            elif KINDS[fault.kind].add is None:
                strikes.append(fault)
                self._faults.pop(number)
            else:
                self._active[number] = fault
        if not self._touched:
            return []
        self._touched = False
        return [self._change(index, strikes) for index in range(self._vehicles)]

    def _change(self, index: int, strikes: list[Fault]) -> Change:
        effects = Effects()
        for fault in self._active.values():
            add = KINDS[fault.kind].add
            if fault.vehicle in (0, index + 1) and add is not None:
                add(effects, fault)
        return Change(index, effects, tuple(fault for fault in strikes if fault.vehicle in (0, index + 1)))
