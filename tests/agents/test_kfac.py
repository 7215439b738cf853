"""K-FAC against calculations by hand: factors sample by sample, the step against least squares, the trust region."""

import pytest
import torch
from torch import nn

from policy.agents.rivals.kfac import Kfac


def regression(samples=4000, inputs=3, outputs=2):
    torch.manual_seed(0)
    x = torch.randn(samples, inputs) @ torch.diag(torch.tensor([3.0, 1.0, 0.2]))
    return x, torch.randn(samples, outputs) + x @ torch.randn(inputs, outputs) + 1.0


def step(kfac, layer, x, y):
    """One step towards y, whose noise is taken to be of variance 1."""
    with kfac.watching():
        guess = layer(x)
    kfac.measure(0.5 * ((guess - (guess + torch.randn_like(guess)).detach()) ** 2).sum(-1))
    layer.zero_grad()
    (0.5 * ((guess - y) ** 2).sum(-1)).mean().backward()
    kfac.step()
    return guess.detach()


def test_a_step_on_a_linear_model_is_newtons_whatever_the_inputs_scale():
    x, y = regression()
    layer = nn.Linear(3, 2)
    step(Kfac(layer, rate=1.0, trust=1e9, damping=1e-9, momentum=0.0), layer, x, y)
    ones = torch.cat((x, torch.ones(len(x), 1)), 1)
    best = torch.linalg.lstsq(ones, y).solution.T
    found = torch.cat((layer.weight, layer.bias[:, None]), 1).detach()
    assert torch.allclose(found, best, atol=0.15)  # the Fisher's output side is drawn: 1 ± 1 / sqrt(4000)


@pytest.mark.parametrize("momentum", [0.0, 0.9])
def test_the_first_step_moves_the_outputs_by_the_trust_region_and_no_further(momentum):
    x, y = regression()
    layer = nn.Linear(3, 2)
    before = step(Kfac(layer, rate=1e9, trust=0.01, damping=1e-6, momentum=momentum), layer, x, y)
    moved = 0.5 * ((layer(x).detach() - before) ** 2).sum(-1).mean()  # the KL of two Gaussians of variance 1
    assert float(moved) == pytest.approx(0.01, rel=0.05)


def test_a_shortened_step_is_that_share_of_it():
    x, y = regression()
    layer = nn.Linear(3, 2)
    begin = layer.weight.detach().clone()
    kfac = Kfac(layer, rate=1e9, trust=0.01)
    step(kfac, layer, x, y)
    whole = layer.weight.detach() - begin
    kfac.shorten(0.25)
    assert torch.allclose(layer.weight.detach() - begin, 0.25 * whole, atol=1e-6)


class Graph(nn.Module):
    """Nodes [N, R, 3] -> two outputs; the first layer is used R times a sample."""

    def __init__(self):
        super().__init__()
        self.nodes, self.out = nn.Linear(3, 4), nn.Linear(4, 2)

    def forward(self, x):
        return self.out(torch.tanh(self.nodes(x)).sum(1))


def test_factors_of_a_layer_used_for_several_nodes_equal_those_of_single_samples():
    torch.manual_seed(1)
    network, x, noise = Graph(), torch.randn(6, 5, 3), torch.randn(6, 2)
    kfac = Kfac(network, rate=1.0)
    with kfac.watching():
        guess = network(x)
    kfac.measure(0.5 * ((guess - (guess + noise).detach()) ** 2).sum(-1))
    left, right = kfac.state()["factors"][0]
    inputs, slopes = torch.zeros(4, 4), torch.zeros(4, 4)
    for sample, its_noise in zip(x, noise, strict=True):
        hidden = network.nodes(sample).detach().requires_grad_()
        answer = network.out(torch.tanh(hidden).sum(0))
        (0.5 * ((answer - (answer + its_noise).detach()) ** 2).sum()).backward()
        for node, slope in zip(sample, hidden.grad, strict=True):
            with_one = torch.cat((node, torch.ones(1)))
            inputs += torch.outer(with_one, with_one) / (6 * 5)
            slopes += torch.outer(slope, slope) / 6
    assert torch.allclose(left, inputs, atol=1e-5)
    assert torch.allclose(right, slopes, atol=1e-5)


def test_other_parameters_than_linear_layers_are_refused():
    with pytest.raises(ValueError, match="linear layers only"):
        Kfac(nn.LayerNorm(3), rate=1.0)
