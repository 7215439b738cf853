"""The whole network: RGCN (Eq. 11), next states (Eq. 12), value (f^val of Eq. 13)."""

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn.functional import linear

from policy.model.features import AOI_SCALE_SLOTS, UAV_ACTION_FEATURES, USER_AOI_COLUMN, USER_SLOTS_COLUMN
from policy.model.rgcn import Rgcn, mlp
from policy.model.spec import ModelSpec

UAV_NEXT = 3  # way east and north in units of reach, energy spent as a share of the battery
USER_NEXT = 4  # way east and north in units of a walk, log AoI and log data as in the features


class Outputs(NamedTuple):
    """In the network's units; evaluators give them real ones."""

    user_cost_slots: Tensor  # [B, M] mean AoI ahead, discounted: (1 - gamma) sum_k gamma^(k-1) kappa_{t+k}
    user_next: Tensor  # [B, M, 4]
    uav_next: Tensor  # [B, U, A, 3] by each of A actions
    relations: Tensor  # [B, U, M] rows of C from UAVs to users, Eq. 11d


class GcrlNetwork(nn.Module):
    """Any number of UAVs and users with the same weights; Xavier uniform at the start ([33] of the paper)."""

    def __init__(self, spec: ModelSpec) -> None:
        super().__init__()
        self.spec = spec
        width = spec.width
        self.rgcn = Rgcn(spec)
        self.predict_uav = mlp(UAV_ACTION_FEATURES + width, width, UAV_NEXT)  # f_1^pred
        self.predict_user = mlp(width, width, USER_NEXT)  # f_2^pred
        self.value = mlp(3 * width, width, width, 2)  # f^val
        self.adds = nn.Parameter(torch.zeros(()))  # what time adds for everybody; the value tells who differs
        self.apply(_xavier)

    def forward(self, uav: Tensor, user: Tensor, uav_mask: Tensor, user_mask: Tensor, action: Tensor) -> Outputs:
        """Features [B, U, 8], [B, M, 19], masks [B, U], [B, M], A actions of each UAV [B, U, A, 2] -> heads."""
        eta_uav, eta_user, relations = self.rgcn(uav, user, uav_mask, user_mask)
        uavs = uav.shape[1]
        return Outputs(
            user_cost_slots=self._user_cost(eta_uav, eta_user, uav_mask, user_mask, user),
            user_next=self.predict_user(eta_user),
            uav_next=_beside(self.predict_uav, action, eta_uav[:, :, None]) + _as_commanded(action),
            relations=relations[:, :uavs, uavs:],
        )

    def _user_cost(
        self, eta_uav: Tensor, eta_user: Tensor, uav_mask: Tensor, user_mask: Tensor, user: Tensor
    ) -> Tensor:
        """Each user's share of f^val: AoI that waits (at most all of it) plus what time adds, never below 1.

        A user served in every slot costs 1; one never served again costs its AoI + 1 / (1 - gamma). The value of a
        state is minus the mean over users, so a state's value needs no fixed number of them. What waits is learned
        beside what it would be if the nearest UAV came at once, 1 - gamma^n of the AoI for a way of n slots, and may
        differ from it so far (``MOST``) only: values of flights that pass users by are flat, and a search on them goes
        on passing them by.
        """
        middle = torch.cat((_mean(eta_uav, uav_mask), _mean(eta_user, user_mask)), dim=-1)
        told = MOST * torch.tanh(_beside(self.value, eta_user, middle[:, None]))
        waits, adds = torch.unbind(told, dim=-1)
        reached = self.spec.gamma ** (torch.clamp(user[..., USER_SLOTS_COLUMN], min=0.0) + IN_RANGE_SLOTS)
        share = torch.sigmoid(waits + torch.log((1.0 - reached) / reached))
        aoi_slots = user[..., USER_AOI_COLUMN] * AOI_SCALE_SLOTS
        return 1.0 + share * (aoi_slots - 1.0) + torch.nn.functional.softplus(self.adds + adds) * ADDS_SCALE


ADDS_SCALE = 4.0  # slots; brings the head's outputs near one
MOST = 0.1  # of both heads, in logits
IN_RANGE_SLOTS = 0.5  # who is in range now may be out of it when the slot ends


def _beside(net: nn.Sequential, own: Tensor, shared: Tensor) -> Tensor:
    """``net`` of ``own`` with ``shared`` behind it; what is shared goes through the first layer once for all."""
    first, width = net[0], own.shape[-1]
    assert isinstance(first, nn.Linear), "an mlp begins with a layer"
    hidden = linear(own, first.weight[:, :width]) + linear(shared, first.weight[:, width:], first.bias)
    for layer in list(net)[1:]:
        hidden = layer(hidden)
    return hidden


def _as_commanded(action: Tensor) -> Tensor:
    """What f_1 learns the difference from: a way [B, U, A, 3] as if the commanded velocity were flown all slot long."""
    return torch.cat((action, torch.zeros_like(action[..., :1])), dim=-1)


def _mean(nodes: Tensor, mask: Tensor) -> Tensor:
    weight = mask[..., None]
    return torch.sum(nodes * weight, dim=1) / torch.clamp(torch.sum(weight, dim=1), min=1.0)


def _xavier(module: nn.Module) -> None:
    if isinstance(module, nn.Linear):
        nn.init.xavier_uniform_(module.weight)
        if module.bias is not None:
            nn.init.zeros_(module.bias)
