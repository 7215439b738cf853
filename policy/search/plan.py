"""What a search answers: every UAV's moves and path over the horizon, their price, and what else was considered."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from policy.search.alternatives import Alternative, Considered
from policy.search.kernel import NO_MOVE
from policy.world.arrays import FloatArray, IntArray
from policy.world.state import JointAction


@dataclass(frozen=True)
class Kept:
    """Plans to start from. Where ``actions`` are NO_MOVE they are open."""

    actions: IntArray  # [U, >= 1] indices into the search's ActionSet
    path_enu_m: FloatArray  # [U, >= 1, 2] at the end of each slot
    vel_enu_mps: FloatArray  # [U, >= 1, 2] at the end of each slot

    def without(self, uav: int) -> "Kept":
        """The same with one UAV's plan thrown away."""
        actions = self.actions.copy()
        actions[uav] = NO_MOVE
        return Kept(actions, self.path_enu_m, self.vel_enu_mps)


@dataclass(frozen=True)
class Plan:
    """U UAVs, H slots. ``value`` in slots of mean AoI: the discounted sum over the horizon and what comes after;
    lower is better. UAVs that do not fly hover in place.
    """

    slot: int  # the first slot planned
    actions: IntArray  # [U, H] indices into the search's ActionSet; polished places: the command nearest to them
    path_enu_m: FloatArray  # [U, H, 2] at the end of each slot
    vel_enu_mps: FloatArray  # [U, H, 2] at the end of each slot; the paper's motion: of the way to it
    first_action: JointAction  # what to fly now
    value: float
    kept_value: float | None  # of the plan kept from the slot before, completed as well as can be; None: no plan kept
    considered: Considered

    @cached_property
    def alternatives(self) -> tuple[tuple[Alternative, ...], ...]:
        """[U] of at most three others, best first; worked out at the first question."""
        return self.considered.alternatives()

    def shifted(self, slots: int = 1) -> Kept:
        """The plan as it stands ``slots`` later: its last slots are open."""
        if slots < 0:
            raise ValueError(f"a plan can only be shifted forward, not by {slots} slots")
        horizon = self.actions.shape[1]
        slot = np.minimum(np.arange(slots, slots + horizon), horizon - 1)
        actions, path_m, vel_mps = (np.take(a, slot, axis=1) for a in (self.actions, self.path_enu_m, self.vel_enu_mps))
        actions[:, max(0, horizon - slots) :] = NO_MOVE
        return Kept(actions, path_m, vel_mps)
