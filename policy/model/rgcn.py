"""Relational graph convolution over UAVs and users, Eq. 11."""

import itertools

import torch
from torch import Tensor, nn

from policy.model.features import UAV_FEATURES, USER_FEATURES
from policy.model.spec import ModelSpec

EPSILON = 1e-6


def mlp(*widths: int) -> nn.Sequential:
    """Fully connected layers with ReLU between them."""
    layers: list[nn.Module] = []
    for before, after in itertools.pairwise(widths):
        layers += [nn.Linear(before, after), nn.ReLU()]
    return nn.Sequential(*layers[:-1])


class Relations(nn.Module):
    """Eq. 11d: how much node i attends to node j, rows summing to one over nodes that take part."""

    def __init__(self, spec: ModelSpec) -> None:
        super().__init__()
        self.similarity = spec.similarity
        self.scale = spec.width**-0.5  # keeps the softmax soft at the start, as in scaled attention
        self.query = nn.Linear(spec.width, spec.width, bias=False)  # W_i
        self.key = nn.Linear(spec.width, spec.width, bias=False)  # W_j

    def forward(self, nodes: Tensor, mask: Tensor) -> Tensor:
        """``nodes`` [B, N, D], ``mask`` [B, N] -> C [B, N, N]."""
        if self.similarity == "gaussian":
            logits = self.query(nodes) @ self.key(nodes).transpose(1, 2) * self.scale
            return torch.softmax(logits + (mask[:, None, :] - 1.0) * 1e9, dim=-1)
        if self.similarity == "cosine":
            unit = nodes / (torch.sqrt(torch.sum(nodes * nodes, dim=-1, keepdim=True)) + EPSILON)
            weight = 0.5 * (1.0 + unit @ unit.transpose(1, 2))
        else:
            weight = (nodes @ nodes.transpose(1, 2)) ** 2
        weight = weight * mask[:, None, :]
        return weight / (torch.sum(weight, dim=-1, keepdim=True) + EPSILON)


class Rgcn(nn.Module):
    """Eq. 11a-f: separate embeddings, one relation matrix, L rounds of messages with skip connections."""

    def __init__(self, spec: ModelSpec) -> None:
        super().__init__()
        self.use_rgcn = spec.use_rgcn
        self.embed_uav = mlp(UAV_FEATURES, spec.width, spec.width)  # f^UAV
        self.embed_user = mlp(USER_FEATURES, spec.width, spec.width)  # f^user
        self.relations = Relations(spec)
        self.messages = nn.ModuleList(nn.Linear(spec.width, spec.width, bias=False) for _ in range(spec.layers))

    def forward(self, uav: Tensor, user: Tensor, uav_mask: Tensor, user_mask: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Features [B, U, Fu], [B, M, Fm] and masks -> eta^u [B, U, D], eta^m [B, M, D], C [B, N, N].

        Without RGCN the nodes keep their embeddings, and C is still told.
        """
        mask = torch.cat((uav_mask, user_mask), dim=1)
        nodes = torch.cat((self.embed_uav(uav), self.embed_user(user)), dim=1)  # Eq. 11c
        relations = self.relations(nodes, mask)
        if self.use_rgcn:
            for message in self.messages:
                nodes = torch.relu(message(relations @ nodes)) + nodes  # Eq. 11e
        uavs = uav.shape[1]
        return nodes[:, :uavs], nodes[:, uavs:], relations
