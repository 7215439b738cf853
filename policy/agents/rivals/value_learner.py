"""What the two methods that learn action values share: Adam's steps towards a slower copy of the network."""

import copy
from typing import Any

from torch import Tensor, nn, optim

from policy.agents.rivals.learner import Learner, LearnerSettings

GREATEST_GRADIENT = 10.0
"""Norm to which gradients are cut (Wang et al., dueling networks, 2016)."""


class ValueLearner(Learner):
    """Holds ``network``, its copy ``_target`` that targets are made with, and their optimiser."""

    def __init__(self, network: nn.Module, settings: LearnerSettings, device: str) -> None:
        super().__init__(settings, device)
        self.network = network.to(self.device)
        self._target = copy.deepcopy(self.network).requires_grad_(requires_grad=False)
        self._optimiser = optim.Adam(self.network.parameters(), lr=settings.learning_rate, eps=1e-5)
        self._updates = 0

    def _descend(self, loss: Tensor) -> float:
        """One step down ``loss``, a scalar, which is given back; now and then the copy catches up."""
        self._optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(self.network.parameters(), GREATEST_GRADIENT)
        self._optimiser.step()
        self._updates += 1
        if self._updates % self.settings.target_every == 0:
            self._target.load_state_dict(self.network.state_dict())
        return float(loss.detach())

    def optimiser_state(self) -> dict[str, Any]:
        """Adam's moments and the target network."""
        return {
            "optimiser": self._optimiser.state_dict(),
            "target": self._target.state_dict(),
            "updates": self._updates,
        }

    def restore_optimiser(self, state: dict[str, Any]) -> None:
        """As saved."""
        self._optimiser.load_state_dict(state["optimiser"])
        self._target.load_state_dict(state["target"])
        self._updates = int(state["updates"])
