"""What a search answers: every UAV's moves and path over the horizon, their price, and what else was considered."""

from dataclasses import dataclass

import numpy as np

from policy.search.kernel import NO_MOVE
from policy.world.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Alternative:
    """The best plan found for one UAV that begins with another move."""

    action: int
    value: float  # of the same kind as Plan.value


@dataclass(frozen=True)
class Plan:
    """U UAVs, H slots. ``value`` in slots of mean AoI: the discounted sum over the horizon and what comes after;
    lower is better. UAVs that do not fly hover in place.
    """

    slot: int  # the first slot planned
    actions: IntArray  # [U, H] indices into the search's ActionSet; NO_MOVE: open
    path_enu_m: FloatArray  # [U, H, 2] at the end of each slot
    value: float
    kept_value: float | None  # of the plan kept from the slot before, completed as well as can be; None: no plan kept
    alternatives: tuple[tuple[Alternative, ...], ...] = ()  # [U] of at most three others, best first

    def shifted(self, slots: int = 1) -> IntArray:
        """The plan as it stands ``slots`` later: actions [U, H], the last ones open."""
        if slots < 0:
            raise ValueError(f"a plan can only be shifted forward, not by {slots} slots")
        left = self.actions[:, slots:]
        open_ = np.full((left.shape[0], self.actions.shape[1] - left.shape[1]), NO_MOVE, dtype=np.int64)
        return np.concatenate((left, open_), axis=1)
