"""What has been seen of users' ways, as methods may know it: the last K slots, never more than was shown."""

import numpy as np

from policy.world.arrays import FloatArray, IntArray
from policy.world.state import WorldState


class StepHistory:
    """Ways of the last K slots, kept from state to state of one campaign."""

    def __init__(self, slots: int) -> None:
        self._slots = slots
        self._before: WorldState | None = None
        self._steps_m: FloatArray = np.zeros((slots, 0, 2))  # [K, M, 2]: the slots' sums are sums of rows
        self._known: IntArray = np.zeros(0, dtype=np.int64)

    def forget(self) -> None:
        """Begin a campaign."""
        self._before = None

    def see(self, state: WorldState) -> None:
        """The next slot's state (no batch dimension); after a gap, or with other users, all begins anew.

        A user who was away in one of the two states has no way between them: 0, and not known.
        """
        before, users = self._before, state.user_pos_enu_m.shape[0]
        if before is None or before.slot != state.slot - 1 or before.user_pos_enu_m.shape[0] != users:
            self._steps_m = np.zeros((self._slots, users, 2))
            self._known = np.zeros(users, dtype=np.int64)
        else:
            both = np.asarray(before.user_active & state.user_active)
            step_m = np.where(both[:, None], state.user_pos_enu_m - before.user_pos_enu_m, 0.0)
            self._steps_m = np.concatenate((step_m[None], self._steps_m[:-1]))
            self._known = np.where(both, np.minimum(self._known + 1, self._slots), 0)
        self._before = state

    @property
    def steps_m(self) -> FloatArray:
        """[M, K, 2] metres, the newest first, 0 where not known."""
        return self._steps_m.swapaxes(0, 1)

    @property
    def known_slots(self) -> IntArray:
        """[M] how many of the newest are known, in a row."""
        return self._known
