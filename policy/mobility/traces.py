"""Where the users are, sample by sample: the one form that files, walkers and tests all produce."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from policy.world.arrays import FloatArray


class TraceError(ValueError):
    """Users that cannot be used: one line that says what is wrong, where, and how to mend it."""


@dataclass(frozen=True)
class UserTraces:
    """Places of M users at T+1 samples, one slot apart; sample t is the start of slot t."""

    user_ids: tuple[str, ...]  # M
    pos_enu_m: FloatArray  # [T+1, M, 2] east, north of the area's south-west corner
    slot_s: float
    source: str  # where they come from, for the records
    notes: tuple[str, ...] = ()  # what cleaning changed, for the operator

    def __post_init__(self) -> None:
        """Hold the invariants that every reader relies on."""
        expected = (self.num_samples, len(self.user_ids), 2)
        if self.pos_enu_m.ndim != 3 or self.pos_enu_m.shape != expected:
            raise ValueError(f"positions must be [T+1, M, 2] = {expected}, got {self.pos_enu_m.shape}")
        if not np.all(np.isfinite(self.pos_enu_m)):
            raise ValueError("positions must be finite")
        if len(set(self.user_ids)) != len(self.user_ids):
            raise ValueError("user ids must be distinct")

    @property
    def num_users(self) -> int:
        """M."""
        return len(self.user_ids)

    @property
    def num_samples(self) -> int:
        """T+1: a campaign of T slots needs one sample more than it has slots."""
        return int(self.pos_enu_m.shape[0])

    def select(self, indices: Sequence[int]) -> "UserTraces":
        """The users at ``indices``, in that order."""
        chosen = [int(index) for index in indices]
        ids = tuple(self.user_ids[index] for index in chosen)
        return replace(self, user_ids=ids, pos_enu_m=self.pos_enu_m[:, chosen, :])

    def without_duplicates(self) -> "UserTraces":
        """The first user of each distinct path: copies would leak from training into test."""
        first: dict[bytes, int] = {}
        for user in range(self.num_users):
            first.setdefault((self.pos_enu_m[:, user, :] + 0.0).tobytes(), user)  # + 0.0: -0.0 equals 0.0
        return self.select(list(first.values()))

    def truncated(self, num_samples: int) -> "UserTraces":
        """The first ``num_samples`` samples."""
        if not 1 <= num_samples <= self.num_samples:
            raise TraceError(f"{self.source}: {num_samples} samples asked, {self.num_samples} there: fly fewer slots")
        return replace(self, pos_enu_m=self.pos_enu_m[:num_samples])
