"""The network run by torch: in training, and beside the exported graph in tests."""

import torch

from policy.model.evaluator import RawOutputs
from policy.model.features import Features, Float32Array
from policy.model.network import GcrlNetwork


class TorchRunner:
    """Runs the module it was given, whatever its weights are by then."""

    def __init__(self, network: GcrlNetwork) -> None:
        self._network = network
        self.spec = network.spec

    def run(self, features: Features, action: Float32Array) -> RawOutputs:
        """Features and actions [B, U, A, 2] -> heads."""
        arrays = (features.uav, features.user, features.uav_mask, features.user_mask, action)
        device = next(self._network.parameters()).device
        with torch.inference_mode():
            heads = self._network(*(torch.from_numpy(array).to(device) for array in arrays))
        return RawOutputs(*(head.cpu().numpy() for head in heads))
