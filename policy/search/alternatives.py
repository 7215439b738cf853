"""What else was considered for a UAV, told when somebody asks."""

import math
from dataclasses import dataclass

from policy.search.kernel import Rounds
from policy.world.actions import ActionSet

ALTERNATIVES = 3


@dataclass(frozen=True)
class Alternative:
    """The best plan found for one UAV that begins with another move."""

    action: int
    value: float  # of the same kind as Plan.value


@dataclass(frozen=True)
class Considered:
    """What the search came by in one slot."""

    actions: ActionSet
    found: Rounds

    def alternatives(self) -> tuple[tuple[Alternative, ...], ...]:
        """Of each UAV [U], at most three, best first."""
        return tuple(self.of(uav) for uav in range(self.found.best.size))

    def of(self, uav: int) -> tuple[Alternative, ...]:
        """The best of each other first command; moves that only end differently are one."""
        others: dict[tuple[float, float], Alternative] = {}
        prices, first = self.found.price[uav].tolist(), self.found.action[uav].tolist()
        flown = self._command(first[self.found.best[uav]])
        for price, action in sorted(pair for pair in zip(prices, first, strict=True) if not math.isnan(pair[0])):
            command = self._command(action)
            if command != flown and command not in others and len(others) < ALTERNATIVES:
                others[command] = Alternative(action, price)
        return tuple(others.values())

    def _command(self, action: int) -> tuple[float, float]:
        return float(self.actions.heading_rad[action]), float(self.actions.speed_mps[action])
