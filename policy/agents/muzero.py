"""MuZero: plans by pUCT on a model that it learned itself, representation, dynamics and reward (the paper's [39]).

After Schrittwieser et al. (2020): Dirichlet noise at the root, n-step value targets, and reanalyse, which searches
remembered slots anew with the network as it is now. A node looks at joint actions drawn from a policy with one head
for each UAV (Hubert et al., Sampled MuZero, 2021), so any number of UAVs can be planned for. The hidden state has
one part for each UAV, and the parts see each other's mean.
"""

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from policy.agents.rivals.agent import LearnedAgent
from policy.agents.rivals.learner import NUM_ACTIONS, Learner, LearnerSettings, reward_scale
from policy.agents.rivals.replay import Replay, Window
from policy.agents.rivals.tree import Found, TreeSettings, search
from policy.environments.field import NUM_FEATURES, features
from policy.world.scenario import Scenario
from policy.world.state import WorldState


@dataclass(frozen=True)
class MuzeroSettings(LearnerSettings):
    """``unroll`` K of the model's losses; ``reanalysed`` slots are searched anew before each update."""

    campaigns: int = 128
    hidden: int = 96
    unroll: int = 4
    n_step: int = 8
    learning_rate: float = 1e-3
    batch_size: int = 64
    simulations: int = 16
    width: int = 16
    noise_share: float = 0.25
    noise_alpha: float = 0.3
    temperature: float = 1.0  # of visits when it explores, at the start; falls with the exploration
    reanalysed: int = 16
    value_weight: float = 0.5
    weight_decay: float = 1e-4
    updates_per_slot: float = 1.0
    explore_start: float = 1.0
    explore_end: float = 0.0


class MuzeroNetwork(nn.Module):
    """h (represent), g (step) and f (judge) of MuZero."""

    def __init__(self, hidden: int) -> None:
        super().__init__()
        self.see = nn.Sequential(nn.Linear(NUM_FEATURES, 2 * hidden), nn.ReLU(), nn.Linear(2 * hidden, hidden))
        self.move = nn.Sequential(nn.Linear(2 * (hidden + NUM_ACTIONS), hidden), nn.ReLU(), nn.Linear(hidden, hidden))
        self.reward = nn.Sequential(nn.Linear(2 * hidden, hidden), nn.ReLU(), nn.Linear(hidden, 1))
        self.policy = nn.Sequential(nn.Linear(2 * hidden, hidden), nn.ReLU(), nn.Linear(hidden, NUM_ACTIONS))
        self.value = nn.Sequential(nn.Linear(2 * hidden, hidden), nn.ReLU(), nn.Linear(hidden, 1))
        self.norm = nn.LayerNorm(hidden)

    def represent(self, seen: Tensor) -> Tensor:
        """Features [N, U, F] -> hidden [N, U, H]."""
        hidden: Tensor = self.norm(self.see(seen))
        return hidden

    def step(self, hidden: Tensor, actions: Tensor) -> tuple[Tensor, Tensor]:
        """Next hidden [N, U, H] and the reward [N], the sum of what each UAV brings."""
        told = torch.cat((hidden, functional.one_hot(actions, NUM_ACTIONS).float()), -1)
        after = self.norm(hidden + self.move(_with_mean(told)))
        return after, self.reward(_with_mean(after))[..., 0].sum(-1)

    def judge(self, hidden: Tensor) -> tuple[Tensor, Tensor]:
        """Policy logits [N, U, 9] and value [N]."""
        seen = _with_mean(hidden)
        return self.policy(seen), self.value(seen)[..., 0].sum(-1)


def _with_mean(parts: Tensor) -> Tensor:
    """Each UAV's part beside the mean of all: [N, U, D] -> [N, U, 2D]."""
    return torch.cat((parts, parts.mean(1, keepdim=True).expand_as(parts)), -1)


class Muzero(Learner):
    """Remembers what the search found, and searches again what it remembers."""

    name = "muzero"
    settings_type = MuzeroSettings
    settings: MuzeroSettings

    def __init__(self, settings: MuzeroSettings, device: str = "cpu") -> None:
        super().__init__(settings, device)
        self.network: MuzeroNetwork = MuzeroNetwork(settings.hidden).to(self.device)
        self._optimiser = torch.optim.AdamW(
            self.network.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
        )
        self._replay = Replay(settings.replay_slots)
        self._tree = TreeSettings(
            settings.simulations, settings.width, settings.gamma, settings.noise_share, settings.noise_alpha
        )

    def begin(self, scenario: Scenario, batch: int) -> None:
        """Nothing is kept from slot to slot."""
        self._scenario, self._scale = scenario, reward_scale(scenario)

    @torch.no_grad()
    def choose(self, state: WorldState, legal: Tensor, explore: float | None = None) -> Tensor:
        """The joint action that the tree visited most, or one drawn by visits."""
        seen = features(self._scenario, state)
        found = search(self.network, self.network.represent(seen), legal, self._tree, noisy=explore is not None)
        if explore is None:
            # Where visits are level, the better value decides.
            best = (found.visits + 1e-3 * found.q.sigmoid()).argmax(-1)
        else:
            heat = max(0.1, self.settings.temperature * explore)
            best = torch.multinomial((found.visits + 1e-9) ** (1.0 / heat), 1)[:, 0]
        actions = found.actions[torch.arange(best.shape[0], device=best.device), best]
        if explore is not None:
            self._seen = {
                "seen": seen,
                "legal": legal,
                "actions": actions,
                "policy": visited_policy(found),
                "value": found.value,
            }
        return actions

    def remember(self, reward: Tensor, *, last: bool) -> None:
        """Keep the slot."""
        self._replay.add({**self._seen, "reward": reward * self._scale}, last=last)

    def learn(self) -> float | None:
        """Reanalyse some slots, then one step of AdamW on unrolled windows."""
        settings = self.settings
        if len(self._replay) < settings.warmup_slots:
            return None
        if settings.reanalysed:
            self._reanalyse(self._replay.draw(settings.reanalysed, 1))
        loss = self._loss(self._replay.draw(settings.batch_size, settings.unroll + settings.n_step))
        self._optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self._optimiser.step()
        return float(loss.detach())

    @torch.no_grad()
    def _reanalyse(self, window: Window) -> None:
        seen = self._replay.gather("seen", window, slice(0, 1))[0]
        legal = self._replay.gather("legal", window, slice(0, 1))[0]
        found = search(self.network, self.network.represent(seen), legal, self._tree, noisy=True)
        self._replay.put("policy", window, 0, visited_policy(found))
        self._replay.put("value", window, 0, found.value)

    def _loss(self, window: Window) -> Tensor:
        settings, replay = self.settings, self._replay
        seen = replay.gather("seen", window, slice(0, 1))[0]
        actions, reward = replay.gather("actions", window), replay.gather("reward", window)
        policy, value = replay.gather("policy", window), replay.gather("value", window)
        targets = self._value_targets(reward, value, window.ahead)
        hidden = self.network.represent(seen)
        losses = []
        for row in range(settings.unroll + 1):
            real = window.ahead[row].float()
            logits, judged = self.network.judge(hidden)
            cross = -(policy[row] * logits.log_softmax(-1)).sum(-1).mean(-1)
            error = functional.huber_loss(judged, targets[row], reduction="none")
            loss = cross + settings.value_weight * error
            if row < settings.unroll:
                hidden, earned = self.network.step(hidden, actions[row])
                hidden = 0.5 * hidden + 0.5 * hidden.detach()  # MuZero, appendix G
                goes_on = window.ahead[row + 1].float()
                loss = loss + 2.0 * goes_on * functional.huber_loss(earned, reward[row], reduction="none")
            losses.append((loss * real).mean() * (1.0 if row == 0 else 1.0 / settings.unroll))
        return torch.stack(losses).sum()

    def _value_targets(self, reward: Tensor, value: Tensor, ahead: Tensor) -> Tensor:
        """n-step returns that end in the root values the searches found: [unroll+1, N]."""
        steps, gamma = self.settings.n_step, self.settings.gamma
        target = torch.zeros_like(value[: self.settings.unroll + 1])
        for row in range(target.shape[0]):
            reach = ahead[row : row + steps + 1].sum(0) - 1
            total = torch.zeros_like(value[0])
            for step in range(steps):
                total = total + gamma**step * reward[row + step] * (step < reach)
            end = (row + reach).clamp(min=0)
            target[row] = total + gamma ** reach.clamp(min=0) * value.gather(0, end[None])[0]
        return target

    def optimiser_state(self) -> dict[str, Any]:
        """AdamW's moments."""
        return {"optimiser": self._optimiser.state_dict()}

    def restore_optimiser(self, state: dict[str, Any]) -> None:
        """As saved."""
        self._optimiser.load_state_dict(state["optimiser"])


def visited_policy(found: Found) -> Tensor:
    """How often each UAV's actions were visited, whatever the others did: [B, U, 9]."""
    share = found.visits / found.visits.sum(-1, keepdim=True)
    chosen = functional.one_hot(found.actions, NUM_ACTIONS).to(share.dtype)  # [B, K, U, 9]
    return (share[:, :, None, None] * chosen).sum(1)


class MuzeroAgent(LearnedAgent):
    """Flies a trained :class:`Muzero`."""

    name = "muzero"
    learner_type = Muzero
