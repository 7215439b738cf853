"""What every method is: an agent that is told the campaign once and then asked once a slot."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState


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
