"""K-FAC: natural gradient with Kronecker factors of each linear layer (Martens and Grosse 2015; ACKTR, Wu et al. 2017).

Own code: kfac-pytorch is not on PyPI, and curvlinops (the well-kept library of such factors) recomputes them from a
data set for analysis, where ACKTR wants running averages, a factored damping and a trust region in one optimiser step.
A layer used for several nodes of a graph counts each of them as a sample (KFAC-expand, Eschenhagen et al., 2023).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import torch
from torch import Tensor, nn


class Kfac:
    """Optimises all :class:`torch.nn.Linear` layers of ``network``; it must have no other parameters."""

    def __init__(
        self,
        network: nn.Module,
        *,
        rate: float,
        trust: float = 0.001,
        damping: float = 0.01,
        momentum: float = 0.9,
        decay: float = 0.95,
        refresh: int = 2,
    ) -> None:
        """``rate`` greatest step size; ``trust`` greatest KL of a step (ACKTR's δ); factors are inverted anew every
        ``refresh`` steps.
        """
        self.rate = rate
        self._trust, self._damping, self._momentum = trust, damping, momentum
        self._decay, self._refresh = decay, refresh
        self._layers = [module for module in network.modules() if isinstance(module, nn.Linear)]
        covered = sum(parameter.numel() for layer in self._layers for parameter in layer.parameters())
        if covered != sum(parameter.numel() for parameter in network.parameters()):
            raise ValueError("K-FAC knows linear layers only; the network has other parameters")
        self._inputs: dict[nn.Linear, list[Tensor]] = {layer: [] for layer in self._layers}
        self._slopes: dict[nn.Linear, list[Tensor]] = {layer: [] for layer in self._layers}
        self._factors: dict[nn.Linear, tuple[Tensor, Tensor]] = {}
        self._inverses: dict[nn.Linear, tuple[Tensor, Tensor]] = {}
        self._speed: dict[nn.Linear, Tensor] = {}
        self._steps, self._factor = 0, 0.0
        self._watching = False
        for layer in self._layers:
            layer.register_forward_hook(self._see)

    @contextmanager
    def watching(self) -> Iterator[None]:
        """The forward pass inside, and the backward pass of the Fisher loss from it, are measured."""
        self._watching = True
        try:
            yield
        finally:
            self._watching = False

    def measure(self, fisher_loss: Tensor) -> None:
        """Update the factors: ``fisher_loss`` [N] is minus the log-likelihood of draws from the model's own outputs."""
        samples = fisher_loss.shape[0]
        fisher_loss.mean().backward(retain_graph=True)  # type: ignore[no-untyped-call]
        for layer in self._layers:
            inputs, slopes = torch.cat(self._inputs[layer]), torch.cat(self._slopes[layer])
            ones = torch.ones((inputs.shape[0], 1), device=inputs.device)
            inputs = torch.cat((inputs, ones), -1)
            # Of a mean over N each sample's own slope is N times what arrives; a sample's nodes add up.
            now = (inputs.T @ inputs / inputs.shape[0], slopes.T @ slopes * samples)
            before = self._factors.get(layer, now)
            keep = min(self._decay, 1.0 - 1.0 / (self._steps + 1))
            self._factors[layer] = (
                keep * before[0] + (1.0 - keep) * now[0],
                keep * before[1] + (1.0 - keep) * now[1],
            )
            self._inputs[layer].clear()
            self._slopes[layer].clear()
            for parameter in layer.parameters():
                parameter.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """Move by the natural gradient of what lies in ``.grad``, no further than the trust region."""
        if self._steps % self._refresh == 0:
            self._invert()
        self._steps += 1
        length = 0.0
        for layer in self._layers:
            left, right = self._inverses[layer]
            natural = right @ _joined_slope(layer) @ left
            speed = self._speed.get(layer, torch.zeros_like(natural))
            self._speed[layer] = self._momentum * speed + (1.0 - self._momentum) * natural
            inputs, slopes = self._factors[layer]
            length += float((self._speed[layer] * (slopes @ self._speed[layer] @ inputs)).sum())
        # ACKTR, Section 3.2: the squared length of the step really taken, momentum and all, is at most 2 δ in the
        # Fisher metric.
        factor = min(self.rate, (2.0 * self._trust / max(length, 1e-12)) ** 0.5)
        self._factor = factor
        self._move(-factor)

    @torch.no_grad()
    def shorten(self, share: float) -> None:
        """Take the last step only this far, where it turned out to lead further than the factors told."""
        self._move((1.0 - share) * self._factor)

    @torch.no_grad()
    def _move(self, factor: float) -> None:
        for layer in self._layers:
            layer.weight.add_(self._speed[layer][:, :-1], alpha=factor)
            layer.bias.add_(self._speed[layer][:, -1], alpha=factor)

    def _see(self, layer: nn.Module, inputs: tuple[Tensor, ...], output: Tensor) -> None:
        if not self._watching or not output.requires_grad:
            return
        assert isinstance(layer, nn.Linear)
        self._inputs[layer].append(inputs[0].detach().flatten(0, -2))
        output.register_hook(lambda slope: self._catch(layer, slope))  # type: ignore[no-untyped-call]

    def _catch(self, layer: nn.Linear, slope: Tensor) -> None:
        if len(self._slopes[layer]) < len(self._inputs[layer]):  # only the first backward pass, the Fisher loss's
            self._slopes[layer].append(slope.detach().flatten(0, -2))

    def _invert(self) -> None:
        """Damped inverses, the damping split by the factors' sizes (Martens and Grosse, 2015, Section 6.3)."""
        for layer, (left, right) in self._factors.items():
            size = torch.sqrt((left.trace() / left.shape[0]) / (right.trace() / right.shape[0]).clamp(min=1e-12))
            size = size.clamp(1e-3, 1e3)
            root = self._damping**0.5
            eye_left = torch.eye(left.shape[0], device=left.device)
            eye_right = torch.eye(right.shape[0], device=right.device)
            self._inverses[layer] = (
                torch.linalg.inv(left + root * size * eye_left),
                torch.linalg.inv(right + root / size * eye_right),
            )

    def state(self) -> dict[str, Any]:
        """To go on later."""
        pairs = [self._factors.get(layer) for layer in self._layers]
        speeds = [self._speed.get(layer) for layer in self._layers]
        return {"factors": pairs, "speed": speeds, "steps": self._steps}

    def restore(self, state: dict[str, Any]) -> None:
        """As :meth:`state` gave it."""
        for layer, pair, speed in zip(self._layers, state["factors"], state["speed"], strict=True):
            if pair is not None:
                self._factors[layer] = (pair[0], pair[1])
            if speed is not None:
                self._speed[layer] = speed
        self._steps = int(state["steps"])
        if self._factors:
            self._invert()


def _joined_slope(layer: nn.Linear) -> Tensor:
    """Gradient of weights and bias side by side: [out, in + 1]; zero where nothing flowed."""
    weight = layer.weight.grad if layer.weight.grad is not None else torch.zeros_like(layer.weight)
    bias = layer.bias.grad if layer.bias.grad is not None else torch.zeros_like(layer.bias)
    return torch.cat((weight, bias[:, None]), 1)
