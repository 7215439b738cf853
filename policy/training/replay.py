"""Episodes remembered, and batches drawn from them."""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from policy.model.features import (
    USER_LOG_AOI_COLUMN,
    USER_LOG_DATA_COLUMN,
    USER_STEP_COLUMN,
    Features,
    Float32Array,
)


@dataclass(frozen=True)
class Episode:
    """One campaign as the network sees it: T slots, T+1 states, U UAVs, M users; float32."""

    uav: Float32Array  # [T+1, U, Fu]
    user: Float32Array  # [T+1, M, Fm]
    uav_mask: Float32Array  # [T+1, U]
    user_mask: Float32Array  # [T+1, M]
    aoi_slots: Float32Array  # [T+1, M]
    action: Float32Array  # [T, U, 2]
    uav_next: Float32Array  # [T, U, 3] as network.Outputs

    @property
    def slots(self) -> int:
        """T."""
        return int(self.action.shape[0])


@dataclass(frozen=True)
class Batch:
    """B transitions, padded to the largest numbers of UAVs and users with masked ones."""

    now: Features
    action: Float32Array  # [B, U, 2]
    uav_next: Float32Array  # [B, U, 3]
    user_next: Float32Array  # [B, M, 4]
    ahead: Features  # the state n slots later
    ahead_weight: Float32Array  # [B] gamma^n
    cost_slots: Float32Array  # [B, M] (1 - gamma) sum_{k=1..n} gamma^(k-1) kappa_{t+k}


USER_NEXT_COLUMNS = (USER_STEP_COLUMN, USER_STEP_COLUMN + 1, USER_LOG_AOI_COLUMN, USER_LOG_DATA_COLUMN)
"""Of the next state's user features: way east and north, log AoI, log data (f_2 of Eq. 12)."""


class Replay:
    """The newest ``capacity`` episodes; the oldest makes room."""

    def __init__(self, capacity: int, episodes: Iterable[Episode] = ()) -> None:
        self._episodes = deque(episodes, maxlen=capacity)

    def __len__(self) -> int:
        return len(self._episodes)

    @property
    def episodes(self) -> Sequence[Episode]:
        """Oldest first."""
        return tuple(self._episodes)

    def add(self, episode: Episode) -> None:
        """Remember one more."""
        self._episodes.append(episode)

    def sample(self, rng: np.random.Generator, size: int, n_step: int, gamma: float) -> Batch:
        """``size`` transitions, each of all remembered equally likely within its episode."""
        chosen = [self._episodes[int(i)] for i in rng.integers(len(self._episodes), size=size)]
        slots = [int(rng.integers(episode.slots)) for episode in chosen]
        return make_batch(chosen, slots, n_step, gamma)


def make_batch(episodes: Sequence[Episode], slots: Sequence[int], n_step: int, gamma: float) -> Batch:
    """Transitions at ``slots`` of ``episodes``; where fewer than n slots follow, n is what is left.

    After the last slot the campaign is taken to go on: the value looks past the end, as a leaf inside does.
    """
    pairs = list(zip(episodes, slots, strict=True))
    ends = [min(t + n_step, e.slots) for e, t in pairs]
    uavs, users = max(e.uav.shape[1] for e in episodes), max(e.user.shape[1] for e in episodes)
    columns = list(USER_NEXT_COLUMNS)
    return Batch(
        now=_features(pairs, uavs, users),
        action=_pad([e.action[t] for e, t in pairs], uavs),
        uav_next=_pad([e.uav_next[t] for e, t in pairs], uavs),
        user_next=_pad([e.user[t + 1][:, columns] for e, t in pairs], users),
        ahead=_features([(e, end) for (e, _), end in zip(pairs, ends, strict=True)], uavs, users),
        ahead_weight=np.array([gamma ** (end - t) for (_, t), end in zip(pairs, ends, strict=True)], dtype=np.float32),
        cost_slots=_pad(
            [discounted(e.aoi_slots[t + 1 : n + 1], gamma) for (e, t), n in zip(pairs, ends, strict=True)], users
        ),
    )


def discounted(aoi_slots: Float32Array, gamma: float) -> Float32Array:
    """(1 - gamma) sum_k gamma^(k-1) kappa_k over the first axis: [n, M] -> [M]."""
    weight = (1.0 - gamma) * gamma ** np.arange(aoi_slots.shape[0])
    return np.asarray(weight @ aoi_slots, dtype=np.float32)


def _features(pairs: Sequence[tuple[Episode, int]], uavs: int, users: int) -> Features:
    return Features(
        uav=_pad([e.uav[t] for e, t in pairs], uavs),
        user=_pad([e.user[t] for e, t in pairs], users),
        uav_mask=_pad([e.uav_mask[t] for e, t in pairs], uavs),
        user_mask=_pad([e.user_mask[t] for e, t in pairs], users),
    )


def _pad(rows: Sequence[Float32Array], length: int) -> Float32Array:
    """Rows [n_i, ...] -> [B, length, ...], zeros behind."""
    padded = np.zeros((len(rows), length, *rows[0].shape[1:]), dtype=np.float32)
    for into, row in zip(padded, rows, strict=True):
        into[: row.shape[0]] = row
    return padded


EPISODE_FIELDS = tuple(f.name for f in fields(Episode))
