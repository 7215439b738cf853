"""DRL-freshMCS: convolutional Q-learning on the state as an 80 x 80 image of several channels.

After the paper's [20] and its note (Section VII-F) that states are mapped into 80 x 80 images; the learning follows
Rainbow (Hessel et al., 2018) with the quantiles of IQN (Dabney et al., 2018) for its distribution: prioritised
replay, n-step returns, double estimator, dueling head. Each UAV looks at an image around itself, the same network for
all; the team's quantiles are the sums of its UAVs' (Sun et al., DFAC, 2021), so 9^U joint actions are never listed.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from policy.agents.rivals.agent import LearnedAgent
from policy.agents.rivals.apart import best_apart
from policy.agents.rivals.learner import (
    NUM_ACTIONS,
    LearnerSettings,
    best_legal,
    explore_legal,
    reward_scale,
)
from policy.agents.rivals.replay import Replay, Window, n_step
from policy.agents.rivals.value_learner import ValueLearner
from policy.environments.field import AOI_UNIT, OWN_FEATURES, own_features
from policy.world.scenario import Scenario
from policy.world.state import WorldState

PIXELS = 80
CHANNELS = 4
"""AoI, users, other UAVs, inside the area."""
PIXELS_PER_SLOT = 6.5
"""A slot's flight at full speed on the image: 42 m a pixel at 18 m/s and 15 s."""
INK = 20.0
"""Scale of the crowd's channels, whose pixels hold shares of all users."""


@dataclass(frozen=True)
class FreshMcsSettings(LearnerSettings):
    """The quantiles are of IQN; priorities after Schaul et al. (2016)."""

    hidden: int = 256
    quantiles: int = 8  # drawn for each update
    acting_quantiles: int = 16  # evenly spread when it decides
    cosines: int = 32
    alpha: float = 0.5
    updates_per_slot: float = 2.0

    may_be_zero: ClassVar[frozenset[str]] = LearnerSettings.may_be_zero | {"alpha"}


class FreshMcsNetwork(nn.Module):
    """Images [N, CHANNELS, 80, 80], own features [N, OWN_FEATURES], quantile levels [N, K] -> quantiles [N, K, 9]."""

    def __init__(self, hidden: int, cosines: int) -> None:
        super().__init__()
        self.look = nn.Sequential(
            nn.Conv2d(CHANNELS, 16, 8, stride=4),
            nn.ReLU(),
            nn.Conv2d(16, 32, 4, stride=2),
            nn.ReLU(),
            nn.Conv2d(32, 32, 3),
            nn.ReLU(),
            nn.Flatten(),
        )
        self.mix = nn.Linear(32 * 6 * 6 + OWN_FEATURES, hidden)
        self.level = nn.Linear(cosines, hidden)
        self.value, self.advantage = nn.Linear(hidden, 1), nn.Linear(hidden, NUM_ACTIONS)
        self.frequency: Tensor
        self.register_buffer("frequency", math.pi * torch.arange(cosines, dtype=torch.float32))

    def forward(self, image: Tensor, own: Tensor, level: Tensor) -> Tensor:
        """Quantile values of each action."""
        seen = functional.relu(self.mix(torch.cat((self.look(image), own), -1)))
        waves = torch.cos(level[..., None] * self.frequency)
        mixed = seen[:, None] * functional.relu(self.level(waves))
        advantage = self.advantage(mixed)
        quantiles: Tensor = self.value(mixed) + advantage - advantage.mean(-1, keepdim=True)
        return quantiles


class DrlFreshMcs(ValueLearner):
    """Remembers places and ages, and draws their images anew when they are learned from."""

    name = "drl-freshmcs"
    settings_type = FreshMcsSettings
    settings: FreshMcsSettings

    def __init__(self, settings: FreshMcsSettings, device: str = "cpu") -> None:
        super().__init__(FreshMcsNetwork(settings.hidden, settings.cosines), settings, device)
        self._replay = Replay(settings.replay_slots, alpha=settings.alpha)

    def begin(self, scenario: Scenario, batch: int) -> None:
        """The image's scale."""
        self._scenario, self._scale = scenario, reward_scale(scenario)
        spread = torch.arange(self.settings.acting_quantiles, device=self.device) + 0.5
        self._levels = spread / self.settings.acting_quantiles

    @torch.no_grad()
    def choose(self, state: WorldState, legal: Tensor, explore: float | None = None) -> Tensor:
        """Greedy in the mean over quantiles, or with a share of random actions."""
        seen = {
            "place": state.uav_pos_enu_m,
            "own": own_features(self._scenario, state),
            "users": state.user_pos_enu_m,
            "age": state.user_aoi_slots * state.user_active,
        }
        count = legal.shape[0] * legal.shape[1]
        value = self._quantiles(self.network, seen, self._levels.expand(count, -1)).mean(-2)
        actions = best_apart(value, legal, state.uav_pos_enu_m)
        if explore is not None:
            actions = explore_legal(actions, legal, explore)
            self._seen = {**seen, "legal": legal, "actions": actions}
        return actions

    def remember(self, reward: Tensor, *, last: bool) -> None:
        """Keep the slot."""
        self._replay.add({**self._seen, "reward": reward * self._scale}, last=last)

    def learn(self) -> float | None:
        """One step of Adam on a batch drawn by priority."""
        if len(self._replay) < self.settings.warmup_slots:
            return None
        window = self._replay.draw(self.settings.batch_size, self.settings.n_step)
        error = self._errors(window)
        self._replay.prioritise(window, error)
        return self._descend((window.weight * error).mean())

    def _errors(self, window: Window) -> Tensor:
        """Quantile Huber loss of each draw [N]."""
        replay, settings = self._replay, self.settings
        reward, actions = replay.gather("reward", window), replay.gather("actions", window, slice(0, 1))[0]
        returns, discount, row = n_step(reward, window.ahead, settings.gamma, settings.n_step)
        then = Window(window.slots.gather(0, row[None]), window.campaigns, window.ahead[:1], window.weight)
        uavs = actions.shape[1]
        with torch.no_grad():
            seen, legal = self._seen_at(then), replay.gather("legal", then)[0]
            even = self._levels.expand(legal.shape[0] * uavs, -1)
            best = best_legal(self._quantiles(self.network, seen, even).mean(-2), legal)
            target_level = self._draw_levels(uavs)
            ahead = self._team(self._quantiles(self._target, seen, target_level), best)
            target = returns[:, None] + discount[:, None] * ahead  # [N, K']
        level = self._draw_levels(uavs)
        now = self._team(self._quantiles(self.network, self._seen_at(window), level), actions)  # [N, K]
        difference = target[:, None, :] - now[:, :, None]
        huber = functional.huber_loss(difference, torch.zeros_like(difference), reduction="none")
        tilt = (level.reshape(-1, uavs, settings.quantiles)[:, 0, :, None] - (difference.detach() < 0).float()).abs()
        return (tilt * huber).mean(2).sum(1)

    def _draw_levels(self, uavs: int) -> Tensor:
        """The same levels for all UAVs of a team [N·U, K]: sums of quantiles at one level are the team's quantiles."""
        level = torch.rand((self.settings.batch_size, 1, self.settings.quantiles), device=self.device)
        return level.expand(-1, uavs, -1).flatten(0, 1)

    def _seen_at(self, window: Window) -> dict[str, Tensor]:
        names = ("place", "own", "users", "age")
        return {name: self._replay.gather(name, window, slice(0, 1))[0] for name in names}

    def _quantiles(self, network: nn.Module, seen: dict[str, Tensor], level: Tensor) -> Tensor:
        """[B, U, K, 9]."""
        image = draw_images(self._scenario, seen["place"], seen["users"], seen["age"])
        answer: Tensor = network(image.flatten(0, 1), seen["own"].flatten(0, 1), level)
        return answer.reshape(*image.shape[:2], *answer.shape[1:])

    @staticmethod
    def _team(quantiles: Tensor, actions: Tensor) -> Tensor:
        """Of the chosen actions, summed over UAVs: [N, U, K, 9], [N, U] -> [N, K]."""
        index = actions[:, :, None, None].expand(-1, -1, quantiles.shape[2], 1)
        return quantiles.gather(-1, index)[..., 0].sum(1)


def draw_images(scenario: Scenario, place_m: Tensor, users_m: Tensor, age_slots: Tensor) -> Tensor:
    """What lies around each UAV, north up: [B, U, 2], [B, M, 2], [B, M] (0: takes no part) -> [B, U, 4, 80, 80].

    A pixel is 1 / 6.5 of a slot's flight; whoever is beyond the image is drawn on its rim.
    """
    pixel_m = scenario.max_speed_mps * scenario.slot_s / PIXELS_PER_SLOT
    batch, uavs = place_m.shape[:2]
    image = torch.zeros((batch, uavs, CHANNELS - 1, PIXELS * PIXELS), device=place_m.device)
    taking_part = (age_slots > 0).float()
    share = INK * taking_part / taking_part.sum(-1, keepdim=True).clamp(min=1.0)
    at = _pixel(users_m[:, None] - place_m[:, :, None], pixel_m)
    image[:, :, 0].scatter_add_(-1, at, (AOI_UNIT * age_slots * share)[:, None].expand(at.shape))
    image[:, :, 1].scatter_add_(-1, at, share[:, None].expand(at.shape))
    others_at = _pixel(place_m[:, None] - place_m[:, :, None], pixel_m)
    others = 1.0 - torch.eye(uavs, device=place_m.device)
    image[:, :, 2].scatter_add_(-1, others_at, others.expand(batch, -1, -1))
    return torch.cat((image.reshape(batch, uavs, CHANNELS - 1, PIXELS, PIXELS), _inside(scenario, place_m, pixel_m)), 2)


def _pixel(relative_m: Tensor, pixel_m: float) -> Tensor:
    column_row = (relative_m / pixel_m + 0.5 * PIXELS).floor().clamp(0, PIXELS - 1).long()
    return column_row[..., 1] * PIXELS + column_row[..., 0]


def _inside(scenario: Scenario, place_m: Tensor, pixel_m: float) -> Tensor:
    """[B, U, 1, 80, 80]: 1 within the area."""
    middle_m = (torch.arange(PIXELS, device=place_m.device) + 0.5 - 0.5 * PIXELS) * pixel_m
    spots = place_m[..., None] + middle_m  # [B, U, 2, 80]
    size_m = torch.tensor(scenario.area.size_m, device=place_m.device)[:, None]
    inside = ((spots >= 0.0) & (spots <= size_m)).float()
    return (inside[:, :, 1, :, None] * inside[:, :, 0, None, :])[:, :, None]


class DrlFreshMcsAgent(LearnedAgent):
    """Flies a trained :class:`DrlFreshMcs`."""

    name = "drl-freshmcs"
    learner_type = DrlFreshMcs
