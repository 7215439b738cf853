"""Where each user will be in the next slots, and how far off that may be: learned, small, run by NumPy.

For every slot ahead a place and a blur b: the forecast is that a user lies, along any line, anywhere within b of the
place with equal chance. That is what the search believes when it is given ``user_blur_m``, so the network is trained
for exactly that (``policy.training.forecast``). Users move whatever UAVs do, hence a network apart from the RGCN's.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from policy.model.features import Float32Array
from policy.model.forecast_features import Seen, forecast_features, turned_back
from policy.model.history import StepHistory
from policy.world.arrays import FloatArray
from policy.world.state import WorldState

FORECAST_SLOTS = 15
"""H: slots ahead."""
LEAST_BLUR = 0.01
"""In walks of a slot."""
WAY_SCALE, BLUR_SHIFT = 2.0, 2.0
"""Bring the outputs near one; the blur begins small."""


@dataclass(frozen=True)
class UserForecast:
    """M users, H slots ahead; the absent stay where they were seen last."""

    pos_enu_m: FloatArray  # [H, M, 2] at the end of each slot
    blur_m: FloatArray  # [H, M]

    def up_to(self, horizon_slots: int) -> "UserForecast":
        """The first slots; beyond H the last one is repeated."""
        if horizon_slots <= self.blur_m.shape[0]:
            return UserForecast(self.pos_enu_m[:horizon_slots], self.blur_m[:horizon_slots])
        rows = np.minimum(np.arange(horizon_slots), self.blur_m.shape[0] - 1)
        return UserForecast(self.pos_enu_m[rows], self.blur_m[rows])


class Forecaster:
    """A trained forecast. Weights are those of ``policy.training.forecast.ForecastNetwork``."""

    def __init__(self, weights: Mapping[str, Float32Array]) -> None:
        self._weights = weights

    def forecast(self, state: WorldState, history: StepHistory, walk_m: float) -> UserForecast:
        """From what ``history`` has seen up to ``state`` (no batch dimension); ``walk_m`` as ``Units.walk_m``."""
        active = np.asarray(state.user_active)
        place_m = np.asarray(state.user_pos_enu_m, dtype=np.float64)
        seen = Seen(place_m[None], history.steps_m[None], history.known_slots[None], active[None])
        features, bearing = forecast_features(seen, walk_m)
        way, blur = self.outputs(features[0].astype(np.float32))
        way_m = walk_m * way.swapaxes(0, 1).astype(np.float64)
        ahead = np.where(active[:, None], bearing[0], 0.0)  # the absent go nowhere
        return UserForecast(
            pos_enu_m=place_m + turned_back(way_m, ahead),
            blur_m=np.where(active, walk_m * blur.T.astype(np.float64), 0.0),
        )

    def outputs(self, features: Float32Array) -> tuple[Float32Array, Float32Array]:
        """[N, F] -> ways along and left [N, H, 2] and blurs [N, H], in walks of a slot.

        In memory all users of one slot lie together, which is how they are read.
        """
        hidden = self._layer("first", (features - self._weights["mean"]) / self._weights["deviation"])
        np.maximum(hidden, 0.0, out=hidden)
        more = self._layer("second", hidden)
        hidden += np.maximum(more, 0.0, out=more)
        out = np.array(self._layer("out", hidden).T, order="C").reshape(FORECAST_SLOTS, 3, -1)
        way, blur = out[:, :2], np.logaddexp(0.0, out[:, 2] - BLUR_SHIFT)
        way *= WAY_SCALE
        blur += np.float32(LEAST_BLUR)
        return way.transpose(2, 0, 1), blur.T

    def _layer(self, name: str, values: Float32Array) -> Float32Array:
        """[N, inputs] -> [N, outputs]."""
        out: Float32Array = values @ self._weights[f"{name}.weight"].T
        out += self._weights[f"{name}.bias"]
        return out
