"""What the forecast of users' places learns from: moments of crowds, and where everybody went."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from policy.model.features import Float32Array
from policy.model.forecast import FORECAST_SLOTS
from policy.model.forecast_features import FORECAST_FEATURES, HISTORY_SLOTS, Seen, forecast_features, turned
from policy.model.states import WALK_MPS
from policy.training.places import real_place
from policy.training.samplers import AnyPlace
from policy.world.arrays import FloatArray, IntArray

MOMENTS_EACH = 64
"""Of a crowd: they change little from slot to slot, so a part teaches as much as all."""
FARTHEST_M = 500.0
"""Who goes farther counts as that far, so that a few riders do not decide what is learned of everybody."""


@dataclass(frozen=True)
class Examples:
    """N moments of users: what was known, and where they went."""

    features: Float32Array  # [N, F]
    way: Float32Array  # [N, H, 2] along and left, in walks of a slot


def examples(pos_enu_m: FloatArray, slot_s: float, moments: IntArray) -> Examples:
    """Of one crowd's places [T+1, M, 2] at ``moments`` (each at most T - H)."""
    walk_m = WALK_MPS * slot_s
    features, bearing = forecast_features(seen_at(pos_enu_m, moments), walk_m)
    ahead = moments[:, None] + np.arange(1, FORECAST_SLOTS + 1)
    way_m = np.swapaxes(pos_enu_m[ahead], 1, 2) - pos_enu_m[moments][:, :, None]
    far = np.linalg.norm(way_m, axis=-1, keepdims=True)
    way = turned(way_m * np.minimum(1.0, FARTHEST_M / np.maximum(far, FARTHEST_M)), bearing[:, :, None]) / walk_m
    return Examples(
        features.reshape(-1, FORECAST_FEATURES).astype(np.float32),
        way.reshape(-1, FORECAST_SLOTS, 2).astype(np.float32),
    )


def seen_at(pos_enu_m: FloatArray, moments: IntArray) -> Seen:
    """What :class:`StepHistory` would hold at each moment."""
    users = pos_enu_m.shape[1]
    back = np.maximum(moments[:, None] - np.arange(HISTORY_SLOTS + 1), 0)
    steps_m = -np.diff(pos_enu_m[back], axis=1)
    known = np.repeat(np.minimum(moments, HISTORY_SLOTS)[:, None], users, axis=1)
    return Seen(pos_enu_m[moments], np.swapaxes(steps_m, 1, 2), known, np.ones(known.shape, dtype=np.bool_))


def walker_examples(crowds: int, seed: int) -> Iterator[Examples]:
    """Crowds of random kind in places of random size."""
    place = AnyPlace()
    for crowd in range(crowds):
        rng = np.random.default_rng([seed, crowd])
        scenario, pos_enu_m = place(rng)
        last = pos_enu_m.shape[0] - 1 - FORECAST_SLOTS
        moments = np.sort(rng.permutation(last + 1)[:MOMENTS_EACH])
        yield examples(pos_enu_m, scenario.slot_s, moments)


def real_examples(name: str, half: int | None = None) -> Examples:
    """All moments of a real set, or of one half of its users. TraceError where it is not at hand."""
    place = real_place(name, half)
    moments = np.arange(place.pos_enu_m.shape[0] - FORECAST_SLOTS)
    return examples(place.pos_enu_m, place.scenario.slot_s, moments)
