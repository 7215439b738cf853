"""pUCT search on a learned model, all campaigns of a batch at once (Schrittwieser et al., MuZero, 2020).

Nodes look at ``K`` joint actions drawn from the policy rather than at all 9^U (Hubert et al., Sampled MuZero, 2021).
"""

from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor

C_INIT, C_BASE = 1.25, 19_652.0
"""MuZero, appendix B."""
LEAST_SPREAD = 0.05
"""Values that differ by less are not pulled apart to 0 and 1: after two visits that would be noise. In the units of
:func:`policy.agents.rivals.learner.reward_scale`, a quarter of a slot of mean AoI.
"""


class Model(Protocol):
    """What the tree asks of the network."""

    def step(self, hidden: Tensor, actions: Tensor) -> tuple[Tensor, Tensor]:
        """Hidden [N, U, H], actions [N, U] -> next hidden and reward [N]."""

    def judge(self, hidden: Tensor) -> tuple[Tensor, Tensor]:
        """Hidden [N, U, H] -> policy logits [N, U, 9] and value [N]."""


@dataclass(frozen=True)
class Found:
    """Of each root: the joint actions looked at [B, K, U], visits [B, K], mean value of the root [B], Q [B, K]."""

    actions: Tensor
    visits: Tensor
    value: Tensor
    q: Tensor


@dataclass(frozen=True)
class TreeSettings:
    """How far and wide the tree grows."""

    simulations: int = 16
    width: int = 16  # joint actions looked at in each node
    gamma: float = 0.95
    noise_share: float = 0.25  # Dirichlet noise on each UAV's policy at the root, while exploring
    noise_alpha: float = 0.3


def search(model: Model, root: Tensor, legal: Tensor, settings: TreeSettings, *, noisy: bool) -> Found:
    """Grow a tree from each root hidden state [B, U, H]; ``legal`` bool [B, U, 9] holds at the root."""
    tree = _Tree(model, root, legal, settings, noisy=noisy)
    for number in range(1, settings.simulations + 1):
        tree.simulate(number)
    return tree.found()


def draw_joint(logits: Tensor, width: int) -> tuple[Tensor, Tensor]:
    """Joint actions to look at and their priors: [B, U, 9] -> [B, K, U], [B, K].

    One UAV's nine are all taken with the policy as prior. For more, every UAV's greedy action comes first, the others
    are drawn from the policy, and each has the same prior: how often a joint action is drawn is its prior.
    """
    batch, uavs, count = logits.shape
    if uavs == 1:
        joint = torch.arange(count, device=logits.device).expand(batch, -1)[..., None]
        return joint, logits[:, 0].softmax(-1)
    chance = logits.softmax(-1)
    drawn = torch.multinomial(chance.reshape(-1, count), width, replacement=True)
    joint = drawn.reshape(batch, uavs, width).transpose(1, 2).contiguous()
    joint[:, 0] = logits.argmax(-1)
    return joint, torch.full((batch, width), 1.0 / width, device=logits.device)


def add_noise(logits: Tensor, legal: Tensor, settings: TreeSettings) -> Tensor:
    """Logits [B, U, 9] of each UAV's policy with a share of Dirichlet noise on its legal actions (bool [B, U, 9]).

    Before joint actions are drawn, as in Sampled MuZero (Section 5.1): noise on the priors of those that were drawn
    would never bring up one that the policy has forgotten.
    """
    gamma = torch.distributions.Gamma(torch.full_like(logits, settings.noise_alpha), torch.ones_like(logits))
    noise = gamma.sample().clamp(min=1e-20) * legal
    noise = noise / noise.sum(-1, keepdim=True)
    mixed = (1.0 - settings.noise_share) * logits.softmax(-1) + settings.noise_share * noise
    return (mixed * legal).clamp(min=1e-30).log().masked_fill(~legal, -1e9)


class _Tree:
    """Node 0 is the root; simulation n adds node n. Shapes: B campaigns, N nodes, K children."""

    def __init__(self, model: Model, root: Tensor, legal: Tensor, settings: TreeSettings, *, noisy: bool) -> None:
        self._model, self._settings = model, settings
        batch, uavs = root.shape[:2]
        logits, value = model.judge(root)
        logits = logits.masked_fill(~legal, -1e9)
        if noisy:
            logits = add_noise(logits, legal, settings)
        actions, prior = draw_joint(logits, settings.width)
        width, nodes, device = prior.shape[1], settings.simulations + 1, root.device
        if uavs == 1:  # all nine stand in the root, also those that are not legal there
            prior = prior * legal[:, 0]
            prior = prior / prior.sum(-1, keepdim=True).clamp(min=1e-9)
        self._allowed = legal[:, 0] if uavs == 1 else torch.ones_like(prior, dtype=torch.bool)
        self._rows = torch.arange(batch, device=device)
        self._hidden = torch.zeros((batch, nodes, *root.shape[1:]), device=device)
        self._hidden[:, 0] = root
        self._actions = torch.zeros((batch, nodes, width, uavs), dtype=torch.long, device=device)
        self._prior = torch.zeros((batch, nodes, width), device=device)
        self._actions[:, 0], self._prior[:, 0] = actions, prior
        self._child = torch.full((batch, nodes, width), -1, dtype=torch.long, device=device)
        self._visits = torch.zeros((batch, nodes, width), device=device)
        self._total = torch.zeros((batch, nodes, width), device=device)
        self._reward = torch.zeros((batch, nodes, width), device=device)
        self._judged = torch.zeros((batch, nodes), device=device)  # the network's value of each node
        self._judged[:, 0] = value
        self._root_total, self._root_count = value.clone(), 1
        self._low = torch.full((batch,), torch.inf, device=device)
        self._high = torch.full((batch,), -torch.inf, device=device)

    def simulate(self, number: int) -> None:
        """Walk down to a child that is not there yet, add it as node ``number``, and tell all above."""
        path = self._descend()
        parent, choice = self._ends(path)
        hidden = self._hidden[self._rows, parent]
        after, reward = self._model.step(hidden, self._actions[self._rows, parent, choice])
        logits, value = self._model.judge(after)
        self._hidden[:, number], self._judged[:, number] = after, value
        self._actions[:, number], self._prior[:, number] = draw_joint(logits, self._settings.width)
        self._child[self._rows, parent, choice] = number
        self._reward[self._rows, parent, choice] = reward
        self._tell(path, value)

    def _descend(self) -> list[tuple[Tensor, Tensor, Tensor]]:
        """(node [B], choice [B], whether this step was taken [B]) from the root on."""
        node = torch.zeros_like(self._rows)
        going = torch.ones_like(self._rows, dtype=torch.bool)
        path = []
        while True:
            choice = self._pick(node)
            path.append((node, choice, going))
            child = self._child[self._rows, node, choice]
            going = going & (child >= 0)
            if not bool(going.any()):
                return path
            node = torch.where(going, child, node)

    def _pick(self, node: Tensor) -> Tensor:
        """The child with the best pUCT score; values are normalised by what this tree has seen.

        A child that was never visited is taken to be worth what its parent is, so that drawn actions get their turn:
        with as few simulations as children, "worth the least" (MuZero's pseudocode) would only repeat the first two.
        """
        visits, prior = self._visits[self._rows, node], self._prior[self._rows, node]
        total = self._total[self._rows, node]
        count = visits.sum(-1, keepdim=True)
        parent = (self._judged[self._rows, node][:, None] + total.sum(-1, keepdim=True)) / (1.0 + count)
        mean = torch.where(visits > 0, total / visits.clamp(min=1.0), parent)
        spread = (self._high - self._low).clamp(min=LEAST_SPREAD)[:, None]
        normal = torch.where(self._high[:, None] >= self._low[:, None], (mean - self._low[:, None]) / spread, 0.0)
        normal = normal.clamp(0.0, 1.0)
        factor = C_INIT + torch.log((count + C_BASE + 1.0) / C_BASE)
        score = normal + factor * prior * torch.sqrt(count + 1.0) / (1.0 + visits)
        at_root = (node == 0)[:, None]
        return score.masked_fill(at_root & ~self._allowed, -torch.inf).argmax(-1)

    def _ends(self, path: list[tuple[Tensor, Tensor, Tensor]]) -> tuple[Tensor, Tensor]:
        """Where each campaign's walk ended: node and choice [B]."""
        parent, choice = path[0][0].clone(), path[0][1].clone()
        for node, chosen, taken in path[1:]:
            parent, choice = torch.where(taken, node, parent), torch.where(taken, chosen, choice)
        return parent, choice

    def _tell(self, path: list[tuple[Tensor, Tensor, Tensor]], value: Tensor) -> None:
        """Discounted value of the new node up the walk."""
        for node, choice, taken in reversed(path):
            reward = self._reward[self._rows, node, choice]
            value = torch.where(taken, reward + self._settings.gamma * value, value)
            counted = taken.to(value.dtype)
            self._visits[self._rows, node, choice] += counted
            self._total[self._rows, node, choice] += counted * value
            mean = self._total[self._rows, node, choice] / self._visits[self._rows, node, choice].clamp(min=1.0)
            self._low = torch.where(taken, torch.minimum(self._low, mean), self._low)
            self._high = torch.where(taken, torch.maximum(self._high, mean), self._high)
        self._root_total = self._root_total + value
        self._root_count += 1

    def found(self) -> Found:
        """What the tree knows of its root."""
        visits = self._visits[:, 0]
        q = self._total[:, 0] / visits.clamp(min=1.0)
        return Found(self._actions[:, 0], visits, self._root_total / self._root_count, q)
