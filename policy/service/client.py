"""The service over HTTP behind the protocol of the one in this process."""

import threading
from dataclasses import dataclass
from typing import Any

import httpx
from pydantic import ValidationError

from policy.agents.base import Decision
from policy.agents.registry import PolicyChoice
from policy.service.validity import check_state, fault_in
from policy.service.wire import DecisionWire, decision_from, scenario_document, state_document
from policy.world.scenario import Scenario
from policy.world.state import WorldState

DEFAULT_TIMEOUT_S = 5.0
"""Half a slot of the shortest useful kind; a decision takes milliseconds."""


class RemotePolicyError(RuntimeError):
    """The service is away, slow, or refused: one line with its own words."""


@dataclass(frozen=True)
class _Campaign:
    scenario: Scenario
    document: dict[str, Any]
    policy: str
    seed: int


class RemotePolicy:
    """Implements :class:`~policy.service.port.PolicyPort` against ``policy serve``."""

    def __init__(
        self,
        url: str,
        *,
        timeout_s: float = DEFAULT_TIMEOUT_S,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        """``url`` such as ``http://127.0.0.1:8090``; ``transport`` for tests without sockets."""
        self._client = httpx.Client(base_url=url, timeout=timeout_s, transport=transport)
        self._lock = threading.Lock()
        self._campaigns: dict[str, _Campaign] = {}

    def begin(self, campaign_id: str, scenario: Scenario, policy: PolicyChoice, seed: int = 0) -> None:
        """Remember the campaign; every ``act`` carries it, so that the service may restart in between."""
        if policy.checkpoint is not None or policy.options:
            raise RemotePolicyError("weights and options are given to the service itself: policy serve --checkpoint")
        campaign = _Campaign(scenario, scenario_document(scenario), policy.name, seed)
        with self._lock:
            self._campaigns[campaign_id] = campaign

    def act(self, campaign_id: str, state: WorldState) -> Decision:
        """Ask for a decision. Raises StateError, RemotePolicyError."""
        with self._lock:
            campaign = self._campaigns.get(campaign_id)
        if campaign is None:
            raise RemotePolicyError(f"campaign {campaign_id!r} has not begun here")
        check_state(campaign.scenario, state)
        decision = decision_from(self._post(campaign_id, campaign, state))
        fault = fault_in(campaign.scenario, decision)
        if fault is not None:
            raise RemotePolicyError(f"{self._client.base_url} answered {fault}")
        return decision

    def end(self, campaign_id: str) -> None:
        """Forget the campaign."""
        with self._lock:
            self._campaigns.pop(campaign_id, None)

    def close(self) -> None:
        """Release the connections."""
        self._client.close()

    def _post(self, campaign_id: str, campaign: _Campaign, state: WorldState) -> DecisionWire:
        request = {
            "campaign_id": campaign_id,
            "scenario": campaign.document,
            "policy": campaign.policy,
            "seed": campaign.seed,
            "state": state_document(state),
        }
        try:
            response = self._client.post("/v1/act", json=request)
        except httpx.HTTPError as error:
            raise RemotePolicyError(f"{self._client.base_url}: {error or type(error).__name__}") from error
        if response.status_code != httpx.codes.OK:
            raise RemotePolicyError(f"{self._client.base_url} refused: {_reason(response)}")
        try:
            return DecisionWire.model_validate_json(response.content)
        except ValidationError as error:
            raise RemotePolicyError(
                f"{self._client.base_url} gave no decision: {error.error_count()} faults"
            ) from error


def _reason(response: httpx.Response) -> str:
    """The detail of a problem document, else the status."""
    try:
        return str(response.json()["detail"])
    except (ValueError, KeyError, TypeError):
        return f"HTTP {response.status_code}"
