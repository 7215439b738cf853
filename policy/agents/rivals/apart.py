"""The best actions of UAVs of which some stand at the same place.

One network that looks from each UAV's own place tells those at one place the same, so their best actions are the same
too, and so is all that comes after: from a common launch point a whole fleet would fly as one UAV. Policies that draw
part by chance; values do not, so here each takes the best action that none before it at its place has taken.
"""

import torch
from torch import Tensor

from policy.agents.rivals.learner import best_legal

SAME_PLACE_M = 1.0
"""Ways over the same actions in another order end at the same place but for rounding."""


def best_apart(values: Tensor, legal: Tensor, place_m: Tensor) -> Tensor:
    """The best legal action of each UAV: [B, U, 9], bool [B, U, 9], [B, U, 2] -> [B, U].

    UAVs at one place get different actions as long as there are legal ones; one for which none is left gets its best.
    """
    actions = best_legal(values, legal)
    together = torch.cdist(place_m, place_m) < SAME_PLACE_M  # [B, U, U]
    for uav in range(1, actions.shape[1]):
        before = torch.nn.functional.one_hot(actions[:, :uav], legal.shape[-1]).bool()  # [B, uav, 9]
        taken = (before & together[:, uav, :uav, None]).any(1)
        free = legal[:, uav] & ~taken
        some_free = free.any(-1, keepdim=True)
        actions[:, uav] = best_legal(values[:, uav], torch.where(some_free, free, legal[:, uav]))
    return actions
