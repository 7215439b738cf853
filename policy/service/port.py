"""What both forms of the service offer."""

from typing import Protocol

from policy.agents.base import Decision
from policy.agents.registry import PolicyChoice
from policy.world.scenario import Scenario
from policy.world.state import WorldState


class PolicyPort(Protocol):
    """One agent a campaign. All methods may be called from any thread."""

    def begin(self, campaign_id: str, scenario: Scenario, policy: PolicyChoice, seed: int = 0) -> None:
        """Start a campaign, or start it anew."""

    def act(self, campaign_id: str, state: WorldState) -> Decision:
        """Decide for the slot that begins at ``state``; the same state again gets the same decision."""

    def end(self, campaign_id: str) -> None:
        """Forget a campaign; nothing happens when it is not known."""
