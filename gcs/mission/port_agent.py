"""A policy service (in process or over HTTP) seen as an agent, so that one planner thread serves both."""

from policy.agents.base import Decision
from policy.agents.registry import PolicyChoice
from policy.service.port import PolicyPort
from policy.world.scenario import Scenario
from policy.world.state import WorldState


class PortAgent:
    """policy.agents.base.Agent over a PolicyPort; ``RemotePolicy`` makes it the policy of another machine."""

    def __init__(self, port: PolicyPort, campaign_id: str, policy: PolicyChoice) -> None:
        self._port, self._campaign_id, self._policy = port, campaign_id, policy
        self.name = policy.name

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Begin the campaign at the service."""
        self._port.begin(self._campaign_id, scenario, self._policy, seed)

    def decide(self, state: WorldState) -> Decision:
        """Ask the service."""
        return self._port.act(self._campaign_id, state)
