"""The network, its slowly following target, and one step of Adam."""

import copy
import math
from typing import Any

import torch
from torch import Tensor

from policy.model.features import Features, Float32Array
from policy.model.network import GcrlNetwork, Outputs
from policy.training.losses import Losses, prediction_loss, value_loss
from policy.training.replay import Batch
from policy.training.settings import TrainingError, TrainSettings

MAX_GRADIENT_NORM = 5.0


class Learner:
    """Lines 12 to 14 of Algorithm 1."""

    def __init__(self, network: GcrlNetwork, settings: TrainSettings) -> None:
        self._settings = settings
        self._device = torch.device(settings.device)
        self.network = network.to(self._device)
        self._target = copy.deepcopy(self.network)
        self._adam = torch.optim.Adam(self.network.parameters(), lr=settings.learning_rate)
        self.updates = 0

    def update(self, batch: Batch, learning_rate: float) -> tuple[float, float]:
        """One step on ``batch``; (L^pred, L^val) before it. TrainingError, with nothing changed, if not finite."""
        losses = self._losses(batch)
        values = (losses.prediction.item(), losses.value.item())
        if not all(math.isfinite(value) for value in values):
            raise TrainingError(
                f"loss is not finite after {self.updates} updates (prediction {values[0]}, value {values[1]})"
            )
        self._adam.zero_grad(set_to_none=True)
        losses.total.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), MAX_GRADIENT_NORM, error_if_nonfinite=False)
        for group in self._adam.param_groups:
            group["lr"] = learning_rate
        self._adam.step()
        self.updates += 1
        if self.updates % self._settings.target_every == 0:
            self._target.load_state_dict(self.network.state_dict())
        return values

    def state(self) -> dict[str, Any]:
        """Everything that the next step depends on."""
        return {
            "network": self.network.state_dict(),
            "target": self._target.state_dict(),
            "adam": self._adam.state_dict(),
            "updates": self.updates,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from :meth:`state`."""
        self.network.load_state_dict(state["network"])
        self._target.load_state_dict(state["target"])
        self._adam.load_state_dict(state["adam"])
        self.updates = int(state["updates"])

    def _losses(self, batch: Batch) -> Losses:
        with torch.no_grad():
            ahead = self._run(self._target, batch.ahead, batch.action).user_cost_slots
        target = self._tensor(batch.cost_slots) + self._tensor(batch.ahead_weight)[:, None] * ahead
        heads = self._run(self.network, batch.now, batch.action)
        uav_mask, user_mask = self._tensor(batch.now.uav_mask), self._tensor(batch.now.user_mask)
        next_states = (self._tensor(batch.uav_next), self._tensor(batch.user_next))
        return Losses(
            prediction=prediction_loss(heads, *next_states, uav_mask, user_mask),
            value=value_loss(heads.user_cost_slots, target, user_mask),
        )

    def _run(self, network: GcrlNetwork, features: Features, action: Float32Array) -> Outputs:
        """Heads for the one action [B, U, 2] that was flown, ``uav_next`` [B, U, 3]."""
        arrays = (features.uav, features.user, features.uav_mask, features.user_mask, action[:, :, None])
        heads: Outputs = network(*(self._tensor(array) for array in arrays))
        return heads._replace(uav_next=heads.uav_next[:, :, 0])

    def _tensor(self, array: Float32Array) -> Tensor:
        return torch.from_numpy(array).to(self._device)
