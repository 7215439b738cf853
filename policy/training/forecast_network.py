"""The forecast of users' places as torch learns it, and what is made small.

Measured and made small is the continuous ranked probability score of the forecast that a user lies within the blur of
the place, along any line, with equal chance: integrated over d, the squared error of the chance to be served by a UAV
at distance d. It rewards the right place and the right doubt alike (Gneiting and Raftery, JASA 102(477), 2007).
"""

import math

import torch
from torch import Tensor, nn
from torch.nn.functional import relu, softplus

from policy.model.forecast import BLUR_SHIFT, FORECAST_SLOTS, LEAST_BLUR, WAY_SCALE
from policy.model.forecast_features import FORECAST_FEATURES

WIDTH = 48
LINES = 4
"""Bearings along which errors are judged: every 45 degrees."""


class ForecastNetwork(nn.Module):
    """Features [N, F] -> ways [N, H, 2] and blurs [N, H] in walks of a slot; begins at "stays where it is"."""

    mean: Tensor  # [F] of the features
    deviation: Tensor  # [F]

    def __init__(self, mean: Tensor, deviation: Tensor) -> None:
        super().__init__()
        self.register_buffer("mean", mean)
        self.register_buffer("deviation", deviation)
        self.first = nn.Linear(FORECAST_FEATURES, WIDTH)
        self.second = nn.Linear(WIDTH, WIDTH)
        self.out = nn.Linear(WIDTH, 3 * FORECAST_SLOTS)
        for layer in (self.first, self.second):
            nn.init.xavier_uniform_(layer.weight)
            nn.init.zeros_(layer.bias)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def forward(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """As ``Forecaster.outputs``."""
        hidden = relu(self.first((features - self.mean) / self.deviation))
        hidden = hidden + relu(self.second(hidden))
        out = self.out(hidden).view(-1, FORECAST_SLOTS, 3)
        return WAY_SCALE * out[..., :2], softplus(out[..., 2] - BLUR_SHIFT) + LEAST_BLUR


def ranked_score(way: Tensor, blur: Tensor, true_way: Tensor) -> Tensor:
    """CRPS of "anywhere within ``blur`` of ``way``", mean over the bearings: [N, H, 2], [N, H], [N, H, 2] -> [N, H]."""
    bearing = torch.arange(LINES, dtype=way.dtype, device=way.device) * (math.pi / LINES)
    lines = torch.stack((torch.cos(bearing), torch.sin(bearing)))
    width = 2.0 * blur[..., None]
    place = ((true_way - way) @ lines) / width + 0.5
    share = torch.clamp(place, 0.0, 1.0)
    return torch.mean(width * (torch.abs(place - share) + share * (share - 1.0) + 1.0 / 3.0), dim=-1)
