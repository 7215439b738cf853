"""ACKTR: actor-critic by Kronecker-factored natural gradient (the paper's [40]), a plain GCN in front.

After Wu et al. (2017). As the paper adds for a fair comparison, a classic graph convolution (Kipf and Welling, 2017)
extracts features: users and UAVs are nodes, near ones are linked by fixed weights. The actor draws every UAV's action
by itself, so a joint action's probability is a product; the critic judges the team.
"""

from dataclasses import dataclass, field
from typing import Any, ClassVar

import torch
from torch import Tensor, nn

from policy.agents.rivals.agent import LearnedAgent
from policy.agents.rivals.kfac import Kfac
from policy.agents.rivals.learner import NUM_ACTIONS, Learner, LearnerSettings, reward_scale
from policy.environments.field import AOI_UNIT, OWN_FEATURES, own_features
from policy.world.scenario import Scenario
from policy.world.state import WorldState

NODE_FEATURES = 14
"""See :func:`node_features`."""


@dataclass(frozen=True)
class AcktrSettings(LearnerSettings):
    """``rollout`` slots of all campaigns make one update."""

    campaigns: int = 16
    hidden: int = 64
    rollout: int = 10
    learning_rate: float = 0.25  # greatest step; the trust region mostly decides
    trust: float = 5e-4
    damping: float = 0.01
    trace: float = 0.8  # λ of the advantage estimate
    entropy: float = 0.05  # weight of the policy's entropy at the start; falls with the exploration
    value_noise: float = 5.0  # standard deviation of the critic's Gaussian: how far a step may move it
    updates_per_slot: float = 1.0  # asked for in every slot; does something when a rollout is complete
    warmup_slots: int = 0
    explore_start: float = 1.0  # it always draws from its own policy: this only scales the entropy's weight
    explore_end: float = 0.0
    explore_share: float = 1.0

    may_be_zero: ClassVar[frozenset[str]] = LearnerSettings.may_be_zero | {"trace", "entropy"}
    shares: ClassVar[frozenset[str]] = LearnerSettings.shares | {"trace"}


@dataclass
class _Rollout:
    """What an update is made of: lists over slots."""

    nodes: list[Tensor] = field(default_factory=list)
    links: list[Tensor] = field(default_factory=list)
    ages: list[Tensor] = field(default_factory=list)
    own: list[Tensor] = field(default_factory=list)
    legal: list[Tensor] = field(default_factory=list)
    actions: list[Tensor] = field(default_factory=list)
    value: list[Tensor] = field(default_factory=list)
    reward: list[Tensor] = field(default_factory=list)


class AcktrNetwork(nn.Module):
    """Graph [N, U, M, NODE_FEATURES] around each UAV -> logits [N, U, 9] and the team's value [N]."""

    def __init__(self, hidden: int) -> None:
        super().__init__()
        self.convolve1, self.convolve2 = nn.Linear(NODE_FEATURES, hidden), nn.Linear(hidden, hidden)
        self.mix = nn.Linear(2 * hidden + OWN_FEATURES, 2 * hidden)
        self.actor = nn.Linear(2 * hidden, NUM_ACTIONS)
        self.weigh = nn.Linear(2 * hidden, hidden)
        self.critic = nn.Linear(hidden, 1)

    def forward(self, nodes: Tensor, links: Tensor, ages: Tensor, own: Tensor) -> tuple[Tensor, Tensor]:
        """``links`` [N, M, M] normalised adjacency, ``ages`` [N, M] each user's AoI by all, 0: not there."""
        links = links[:, None]
        hidden = torch.relu(self.convolve1(nodes))
        hidden = torch.relu(self.convolve2(links @ hidden))
        present = (ages > 0).to(hidden.dtype)
        present = present / present.sum(-1, keepdim=True).clamp(min=1.0)
        pooled = torch.stack((ages, present), 1)[:, None] @ hidden  # [N, U, 2, H]
        seen = torch.tanh(self.mix(torch.cat((pooled.flatten(-2), own), -1)))
        return self.actor(seen), self.critic(torch.tanh(self.weigh(seen.sum(1))))[..., 0]


class Acktr(Learner):
    """On policy: nothing is remembered beyond the rollout."""

    name = "acktr"
    settings_type = AcktrSettings
    settings: AcktrSettings

    def __init__(self, settings: AcktrSettings, device: str = "cpu") -> None:
        super().__init__(settings, device)
        self.network = AcktrNetwork(settings.hidden).to(self.device)
        nn.init.orthogonal_(self.network.actor.weight, 0.01)
        self._kfac = Kfac(self.network, rate=settings.learning_rate, trust=settings.trust, damping=settings.damping)
        self._rollout = _Rollout()
        self._ends_here, self._explore = False, 1.0

    def begin(self, scenario: Scenario, batch: int) -> None:
        """A rollout never spans two campaigns."""
        self._scenario, self._scale = scenario, reward_scale(scenario)
        self._rollout = _Rollout()

    @torch.no_grad()
    def choose(self, state: WorldState, legal: Tensor, explore: float | None = None) -> Tensor:
        """Drawn from the policy, in flight too: it was trained as one that draws, and its likeliest actions alone
        would lead a UAV that remembers nothing to where it stays.
        """
        graph = node_features(self._scenario, state), *graph_links(self._scenario, state)
        own = own_features(self._scenario, state)
        logits, value = self.network(*graph, own)
        actions: Tensor = _drawing(logits, legal).sample()
        if explore is None:
            return actions
        self._explore = explore
        rollout = self._rollout
        for kept, new in zip(
            (rollout.nodes, rollout.links, rollout.ages, rollout.own, rollout.legal, rollout.actions, rollout.value),
            (*graph, own, legal, actions, value),
            strict=True,
        ):
            kept.append(new)
        return actions

    def remember(self, reward: Tensor, *, last: bool) -> None:
        """The rollout grows by a slot."""
        self._rollout.reward.append(reward * self._scale)
        self._ends_here = last

    def learn(self) -> float | None:
        """A K-FAC step when the rollout is complete. Its last slot only gives the value that follows."""
        slots = len(self._rollout.reward)
        if slots < 2 or (slots <= self.settings.rollout and not self._ends_here):
            return None
        loss = self._update()
        last = self._rollout
        self._rollout = _Rollout()
        if not self._ends_here:  # the last slot begins the next rollout
            for kept, old in zip(vars(self._rollout).values(), vars(last).values(), strict=True):
                kept.append(old[-1])
        return loss

    def _update(self) -> float:
        rollout, settings = self._rollout, self.settings
        returns, advantage = self._advantages()
        joined = [torch.cat(values[:-1]) for values in (rollout.nodes, rollout.links, rollout.ages, rollout.own)]
        legal, actions = torch.cat(rollout.legal[:-1]), torch.cat(rollout.actions[:-1])
        with self._kfac.watching():
            logits, value = self.network(*joined)
        policy = _drawing(logits, legal)
        # The Fisher is of the model's own outputs: drawn actions, and values with noise (Wu et al., Section 3.1).
        drawn = policy.log_prob(policy.sample()).sum(-1)
        noisy = 0.5 * (value - (value + settings.value_noise * torch.randn_like(value)).detach()) ** 2
        noisy = noisy / settings.value_noise**2
        self._kfac.measure(noisy - drawn)
        actor = -(advantage * policy.log_prob(actions).sum(-1)).mean()
        critic = 0.5 * ((returns - value) ** 2).mean() / settings.value_noise**2
        loss = actor + critic - settings.entropy * self._explore * policy.entropy().sum(-1).mean()
        self.network.zero_grad(set_to_none=True)
        loss.backward()
        self._kfac.step()
        self._keep_trust(joined, legal, policy)
        return float(loss.detach())

    @torch.no_grad()
    def _keep_trust(self, joined: list[Tensor], legal: Tensor, before: Any) -> None:
        """The KL that the policy really moved by; it grows with the square of the step."""
        after = _drawing(self.network(*joined)[0], legal)
        moved = float(torch.distributions.kl_divergence(before, after).sum(-1).mean())
        if moved > 2.0 * self.settings.trust:
            self._kfac.shorten((self.settings.trust / moved) ** 0.5)

    def _advantages(self) -> tuple[Tensor, Tensor]:
        """Returns and normalised advantages of all but the last slot: [(T-1) B] (Schulman et al., GAE, 2016).

        All campaigns are in the same slot, so their mean is a baseline that needs no learning.
        """
        settings = self.settings
        values, rewards = torch.stack(self._rollout.value), torch.stack(self._rollout.reward)
        running, found = torch.zeros_like(values[0]), []
        for slot in reversed(range(values.shape[0] - 1)):
            error = rewards[slot] + settings.gamma * values[slot + 1] - values[slot]
            running = error + settings.gamma * settings.trace * running
            found.append(running)
        advantage = torch.stack(found[::-1])
        returns = (advantage + values[:-1]).flatten()
        advantage = advantage - advantage.mean(1, keepdim=True)
        return returns, (advantage / (advantage.std() + 1e-6)).flatten()

    def optimiser_state(self) -> dict[str, Any]:
        """K-FAC's factors and momentum."""
        return {"kfac": self._kfac.state()}

    def restore_optimiser(self, state: dict[str, Any]) -> None:
        """As saved."""
        self._kfac.restore(state["kfac"])


def _drawing(logits: Tensor, legal: Tensor) -> Any:
    """The policy over legal actions. Any: torch's distributions are not typed."""
    return torch.distributions.Categorical(logits=logits.masked_fill(~legal, -1e9))


def node_features(scenario: Scenario, state: WorldState) -> Tensor:
    """Each user as each UAV sees it: [B, U, M, NODE_FEATURES].

    Relative place in slots of flight (2), distance, direction by two harmonics (4) faded in over the first slot's
    way, distance cut at 1, 2 and 4 slots (3), age, share of data, whether another UAV is nearer, by how much.
    """
    place, users = state.uav_pos_enu_m, state.user_pos_enu_m
    step_m = scenario.max_speed_mps * scenario.slot_s
    relative = (users[:, None] - place[:, :, None]) / step_m
    distance = relative.norm(dim=-1)
    angle = torch.atan2(relative[..., 1], relative[..., 0])
    fade = distance.clamp(max=1.0)
    others = distance[:, None].masked_fill(
        torch.eye(place.shape[1], dtype=torch.bool, device=place.device)[None, :, :, None], torch.inf
    )
    lead = (others.amin(2).clamp(max=20.0) - distance).clamp(-2.0, 2.0)  # how much nearer than the nearest other
    age = (AOI_UNIT * state.user_aoi_slots).clamp(max=10.0)[:, None].expand_as(distance)
    data = state.user_data_mb / (state.user_data_mb.amax(-1, keepdim=True) + 1e-6)
    rows = (
        0.5 * relative[..., 0],
        0.5 * relative[..., 1],
        0.3 * distance,
        fade * angle.cos(),
        fade * angle.sin(),
        fade * (2.0 * angle).cos(),
        fade * (2.0 * angle).sin(),
        fade,
        0.5 * distance.clamp(max=2.0),
        0.25 * distance.clamp(max=4.0),
        age,
        data[:, None].expand_as(distance),
        (lead < 0).to(distance.dtype),
        0.5 * lead,
    )
    return torch.stack(rows, -1)


def graph_links(scenario: Scenario, state: WorldState) -> tuple[Tensor, Tensor]:
    """Normalised adjacency of users [B, M, M], self-links included, and the users' shares of all AoI units [B, M]."""
    users, active = state.user_pos_enu_m, state.user_active.to(state.user_pos_enu_m.dtype)
    apart = torch.cdist(users, users)
    near = torch.exp(-((apart / (0.5 * scenario.max_speed_mps * scenario.slot_s)) ** 2)) * active[:, None, :]
    near = near + 1e-6 * torch.eye(users.shape[1], device=users.device)
    ages = AOI_UNIT * state.user_aoi_slots * active / active.sum(-1, keepdim=True).clamp(min=1.0)
    return near / near.sum(-1, keepdim=True), ages


class AcktrAgent(LearnedAgent):
    """Flies a trained :class:`Acktr`."""

    name = "acktr"
    learner_type = Acktr
