"""What every method is: an agent that is told the campaign once and then asked once a slot."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState


class Explanation(Mapping[str, Any]):
    """What is told beside a decision, worked out when somebody asks: the UAVs need not wait for it."""

    def __init__(self, tell: Callable[[], Mapping[str, Any]]) -> None:
        """``tell`` reads only what does not change any more; it may be called from another thread."""
        self._tell = tell

    @cached_property
    def _told(self) -> Mapping[str, Any]:
        return self._tell()

    def __getitem__(self, key: str) -> Any:
        """As of a dict."""
        return self._told[key]

    def __iter__(self) -> Iterator[str]:
        """As of a dict."""
        return iter(self._told)

    def __len__(self) -> int:
        """As of a dict."""
        return len(self._told)


@dataclass(frozen=True)
class Decision:
    """An answer for one slot. ``explanation`` is JSON-able: why this, and what else was considered."""

    action: JointAction  # heading_rad [U], speed_mps [U]
    value: float | None = None
    explanation: Mapping[str, Any] = field(default_factory=dict)


class Agent(Protocol):
    """A method. One instance flies one campaign at a time; it may keep its plan from slot to slot."""

    name: str

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Begin a campaign. ``scenario.max_accel_mps2`` is the limit of the vehicles that will fly it."""

    def decide(self, state: WorldState) -> Decision:
        """Choose for the slot that begins at ``state`` (no batch dimension)."""
