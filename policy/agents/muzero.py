"""MuZero: plans by pUCT on a model that it learned itself, representation, dynamics and reward (the paper's [39]).

After Schrittwieser et al. (2020): Dirichlet noise at the root, n-step value targets, and reanalyse, which searches
remembered slots anew with the network as it is now. A node looks at joint actions drawn from a policy with one head
for each UAV (Hubert et al., Sampled MuZero, 2021), so any number of UAVs can be planned for. The hidden state has
one part for each UAV, and the parts see each other's mean.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

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

    campaigns: int = 64
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
    reanalysed: int = 64  # slots searched anew at a time ...
    reanalyse_every: int = 4  # ... before every so many updates
    value_weight: float = 0.5
    weight_decay: float = 1e-4
    updates_per_slot: float = 2.0
    explore_start: float = 1.0
    explore_end: float = 0.0

    may_be_zero: ClassVar[frozenset[str]] = LearnerSettings.may_be_zero | {
        "noise_share",
        "temperature",
        "reanalysed",
        "value_weight",
        "weight_decay",
    }
    shares: ClassVar[frozenset[str]] = LearnerSettings.shares | {"noise_share"}


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
        self._updates = 0

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
        window = self._replay.draw(settings.batch_size, settings.unroll + settings.n_step)
        if settings.reanalysed and self._updates % settings.reanalyse_every == 0:
            self._reanalyse(window)
        self._updates += 1
        loss = self._loss(window)
        self._optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self._optimiser.step()
        return float(loss.detach())

    @torch.no_grad()
    def _reanalyse(self, window: Window) -> None:
        """Search the starts of some windows anew: their policies are then those of the network as it is now."""
        count = self.settings.reanalysed
        some = Window(window.slots[:, :count], window.campaigns[:count], window.ahead[:, :count], window.weight[:count])
        seen = self._replay.gather("seen", some, slice(0, 1))[0]
        legal = self._replay.gather("legal", some, slice(0, 1))[0]
        found = search(self.network, self.network.represent(seen), legal, self._tree, noisy=True)
        self._replay.put("policy", some, 0, visited_policy(found))

    def _loss(self, window: Window) -> Tensor:
        settings, replay = self.settings, self._replay
        seen = replay.gather("seen", window, slice(0, 1))[0]
        actions, reward = replay.gather("actions", window), replay.gather("reward", window)
        policy = replay.gather("policy", window, slice(0, settings.unroll + 1))
        targets = value_targets(reward, self._values_ahead(window), window.ahead, settings.gamma)
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

    @torch.no_grad()
    def _values_ahead(self, window: Window) -> Tensor:
        """What the network as it is now makes of the states ``n_step`` slots after each unrolled row [unroll+1, N].

        Not what was found when they were flown: early values are worth nothing, and a slot is searched anew about
        once in a training (MuZero, appendix H: a fresh network provides the values that targets end in).
        """
        seen = self._replay.gather("seen", window, slice(self.settings.n_step, None))
        rows, draws = seen.shape[:2]
        value: Tensor = self.network.judge(self.network.represent(seen.flatten(0, 1)))[1]
        return value.reshape(rows, draws)

    def optimiser_state(self) -> dict[str, Any]:
        """AdamW's moments."""
        return {"optimiser": self._optimiser.state_dict(), "updates": self._updates}

    def restore_optimiser(self, state: dict[str, Any]) -> None:
        """As saved."""
        self._optimiser.load_state_dict(state["optimiser"])
        self._updates = int(state["updates"])


def value_targets(reward: Tensor, value_after: Tensor, ahead: Tensor, gamma: float) -> Tensor:
    """n-step returns of the first R rows of a window: [R, N].

    ``reward`` [R+n, N]; ``value_after`` [R, N] of the states n slots after each row, or of the campaign's last state
    where it ends earlier; ``ahead`` bool [R+n, N] as of :class:`Window`.
    """
    rows = value_after.shape[0]
    steps = reward.shape[0] - rows
    targets = []
    for row in range(rows):
        reach = (ahead[row : row + steps + 1].sum(0) - 1).clamp(min=0)  # slots that really follow, at most n
        discounts = gamma ** torch.arange(steps, device=reward.device)[:, None]
        taken = torch.arange(steps, device=reward.device)[:, None] < reach
        earned = (discounts * reward[row : row + steps] * taken).sum(0)
        targets.append(earned + gamma**reach * value_after[row])
    return torch.stack(targets)


def visited_policy(found: Found) -> Tensor:
    """How often each UAV's actions were visited, whatever the others did: [B, U, 9]."""
    share = found.visits / found.visits.sum(-1, keepdim=True)
    chosen = functional.one_hot(found.actions, NUM_ACTIONS).to(share.dtype)  # [B, K, U, 9]
    return (share[:, :, None, None] * chosen).sum(1)


class MuzeroAgent(LearnedAgent):
    """Flies a trained :class:`Muzero`."""

    name = "muzero"
    learner_type = Muzero
