"""What is made small: Eq. 15 for the predictor, Eq. 16 for the value."""

from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import smooth_l1_loss

from policy.model.network import Outputs

STANDING_WALKS = 0.25
"""In walks of a slot: errors up to 5 m count as squares."""
WAY_WEIGHT = 4.0
"""Of a UAV's way, in ways of a slot: where it gets decides whom it serves, a tenth of a way is 27 m of 226."""
ENERGY_WEIGHT = 100.0
"""Of the energy spent, in batteries: a slot costs some 0.6 % of one."""
STATE_WEIGHT = 4.0
"""Leaves are told apart by their states' values; users' shares only help to find them."""


class Losses(NamedTuple):
    """Scalars."""

    prediction: Tensor
    value: Tensor

    @property
    def total(self) -> Tensor:
        """Both heads share the RGCN, so one step serves both."""
        return self.prediction + self.value


def prediction_loss(heads: Outputs, uav_next: Tensor, user_next: Tensor, uav_mask: Tensor, user_mask: Tensor) -> Tensor:
    """Eq. 15: squared error of the next state in the network's units, over those that take part, UAVs weighed.

    Of users' ways beyond a few metres the absolute error (Huber): most people stand and some ride, so the squared
    one, which asks for the mean, lets everybody creep; the absolute one asks for what usually happens.
    """
    uav_weight = uav_next.new_tensor((WAY_WEIGHT, WAY_WEIGHT, ENERGY_WEIGHT))
    uav_error = torch.sum(uav_weight * (heads.uav_next - uav_next) ** 2, dim=-1)
    way_error = smooth_l1_loss(heads.user_next[..., :2], user_next[..., :2], beta=STANDING_WALKS, reduction="none")
    user_error = torch.sum(way_error, dim=-1) + torch.sum((heads.user_next[..., 2:] - user_next[..., 2:]) ** 2, dim=-1)
    return _masked_mean(uav_error, uav_mask) + _masked_mean(user_error, user_mask)


def value_loss(user_cost: Tensor, target: Tensor, user_mask: Tensor) -> Tensor:
    """Eq. 16 on the state's value, and the same on every user's share of it.

    Relative to the state's own cost, so that crowded and far-flung places weigh alike. Costs [B, M] in slots.
    """
    count = torch.clamp(torch.sum(user_mask, dim=1), min=1.0)
    scale = torch.sum(target * user_mask, dim=1) / count
    scale = torch.clamp(scale, min=1.0)
    error = (user_cost - target) * user_mask / scale[:, None]
    state_error = torch.sum(error, dim=1) / count
    return STATE_WEIGHT * torch.mean(state_error**2) + torch.mean(torch.sum(error**2, dim=1) / count)


def _masked_mean(error: Tensor, mask: Tensor) -> Tensor:
    return torch.sum(error * mask) / torch.clamp(torch.sum(mask), min=1.0)
