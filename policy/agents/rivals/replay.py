"""Experience of many campaigns flown in step: a ring of slots, so that what follows a slot is found by its index.

Own code rather than a library's: experience already lies in tensors, a draw by priority is one cumulative sum over
them, and sequences, n-step returns and unrolls are all windows along the ring.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Window:
    """Places in the ring: row k of ``slots`` [K+1, N] is k slots after the start, held at the campaign's last slot.

    ``ahead`` bool [K+1, N]: whether row k is really k slots on, not a repetition of the last one.
    """

    slots: Tensor
    campaigns: Tensor  # [N]
    ahead: Tensor
    weight: Tensor  # [N] importance of each draw, greatest 1


class Replay:
    """The newest slots of B campaigns; the oldest make room."""

    def __init__(self, slots: int, *, alpha: float = 0.0, beta: float = 0.4) -> None:
        """``slots`` counts all campaigns together. ``alpha`` 0 draws evenly (Schaul et al. 2016 for both)."""
        self._capacity, self._alpha, self._beta = slots, alpha, beta
        self._fields: dict[str, Tensor] = {}
        self._priority: Tensor  # [L, B]
        self._left: Tensor  # [L]: slots that follow within the campaign, among those written
        self._length = 0  # L, when the first slot comes
        self._written = 0
        self._episode = 0  # slots of the present campaign so far
        self._greatest = 1.0

    def __len__(self) -> int:
        """Campaign slots remembered."""
        if not self._length:
            return 0
        return min(self._written, self._length) * int(self._priority.shape[1])

    def add(self, values: Mapping[str, Tensor], *, last: bool) -> None:
        """One slot of all campaigns: each tensor [B, ...]."""
        if not self._length:
            self._allocate(values)
        at = self._written % self._length
        for name, value in values.items():
            self._fields[name][at] = value.to(self._fields[name].dtype)
        self._priority[at] = self._greatest
        # Every earlier slot of this campaign now has one more slot after it.
        reach = min(self._episode, self._length - 1)
        before = (at - 1 - torch.arange(reach, device=self._left.device)) % self._length
        self._left[before] += 1
        self._left[at] = 0
        self._written += 1
        self._episode = 0 if last else self._episode + 1

    def draw(self, size: int, span: int) -> Window:
        """``size`` windows of ``span`` slots after their start; starts have at least one slot after them."""
        row_ok = self._left > 0
        if self._written > self._length:  # the slots before the oldest are gone; the newest ring row has none after it
            row_ok = row_ok.clone()
        chance = (self._priority**self._alpha) * row_ok[:, None]
        mass = chance.reshape(-1).cumsum(0, dtype=torch.float64)
        points = torch.rand(size, dtype=torch.float64, device=mass.device) * mass[-1]
        flat = torch.searchsorted(mass, points, right=True).clamp(max=mass.numel() - 1)
        start, campaign = flat // self._priority.shape[1], flat % self._priority.shape[1]
        steps = torch.arange(span + 1, device=start.device)[:, None]
        left = self._left[start]
        slots = (start + torch.minimum(steps, left)) % self._length
        share = chance[start, campaign] / mass[-1]
        weight = (
            (share * row_ok.sum() * self._priority.shape[1]) ** -self._beta if self._alpha else torch.ones_like(share)
        )
        return Window(slots, campaign, steps <= left, (weight / weight.max()).to(torch.float32))

    def gather(self, name: str, window: Window, rows: slice = slice(None)) -> Tensor:
        """A field along windows: [K+1, N, ...] (``rows`` of the first axis), floats as float32."""
        value = self._fields[name][window.slots[rows], window.campaigns]
        return value.float() if value.is_floating_point() else value

    def put(self, name: str, window: Window, row: int, value: Tensor) -> None:
        """Write a field of one row of ``window`` anew: [N, ...]."""
        self._fields[name][window.slots[row], window.campaigns] = value.to(self._fields[name].dtype)

    def prioritise(self, window: Window, error: Tensor) -> None:
        """How wrong each start was [N]."""
        priority = error.detach().abs() + 1e-3
        self._greatest = max(self._greatest, float(priority.max()))
        self._priority[window.slots[0], window.campaigns] = priority

    def _allocate(self, values: Mapping[str, Tensor]) -> None:
        batch = next(iter(values.values())).shape[0]
        device = next(iter(values.values())).device
        self._length = max(2, self._capacity // batch)
        for name, value in values.items():
            kept = torch.float16 if value.is_floating_point() and value.ndim > 1 else value.dtype
            self._fields[name] = torch.zeros((self._length, *value.shape), dtype=kept, device=device)
        self._priority = torch.zeros((self._length, batch), device=device)
        self._left = torch.zeros(self._length, dtype=torch.long, device=device)


def n_step(reward: Tensor, ahead: Tensor, gamma: float, steps: int) -> tuple[Tensor, Tensor, Tensor]:
    """Sum of up to ``steps`` rewards from each start, and where the value is to be looked up after them.

    ``reward`` [K+1, N], ``ahead`` bool [K+1, N] of a window -> (returns [N], discount of the value after them [N],
    its row [N]). A campaign that ends earlier is taken to go on: the value is that of its last slot's state.
    """
    reach = ahead[: steps + 1].sum(0) - 1  # rows that really follow, at most ``steps``
    discounts = gamma ** torch.arange(steps, device=reward.device, dtype=reward.dtype)
    taken = torch.arange(steps, device=reward.device)[:, None] < reach
    returns = (discounts[:, None] * reward[:steps] * taken).sum(0)
    return returns, gamma ** reach.to(reward.dtype), reach
