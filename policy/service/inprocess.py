"""The service in this process: one agent a campaign, each behind its own lock."""

import threading
from collections import OrderedDict
from dataclasses import dataclass, field

import numpy as np

from policy.agents.base import Agent, Decision
from policy.agents.registry import PolicyChoice
from policy.service.validity import check_state, fault_in
from policy.world.scenario import Scenario
from policy.world.state import WorldState

MAX_CAMPAIGNS = 64
"""Campaigns kept at once; the one unused for longest makes room."""


class UnknownCampaignError(LookupError):
    """``act`` before ``begin``, or after the campaign made room for others."""


class PolicyFaultError(RuntimeError):
    """A policy answered something that cannot be flown: a defect in it."""


@dataclass
class _Session:
    scenario: Scenario
    agent: Agent
    lock: threading.Lock = field(default_factory=threading.Lock)
    answered: tuple[bytes, Decision] | None = None  # the newest state and what was decided for it


class PolicyService:
    """Implements :class:`~policy.service.port.PolicyPort`."""

    def __init__(self, max_campaigns: int = MAX_CAMPAIGNS) -> None:
        """Holds at most ``max_campaigns`` agents."""
        self._max_campaigns = max_campaigns
        self._lock = threading.Lock()
        self._sessions: OrderedDict[str, _Session] = OrderedDict()

    def begin(self, campaign_id: str, scenario: Scenario, policy: PolicyChoice, seed: int = 0) -> None:
        """Start a campaign, or start it anew. Raises UnknownPolicyError or the method's CheckpointError.

        The agent is built outside the lock: loading weights must not hold up other campaigns' decisions.
        """
        agent = policy.build()
        agent.reset(scenario, seed)
        with self._lock:
            self._sessions[campaign_id] = _Session(scenario, agent)
            self._sessions.move_to_end(campaign_id)
            while len(self._sessions) > self._max_campaigns:
                self._sessions.popitem(last=False)

    def act(self, campaign_id: str, state: WorldState) -> Decision:
        """Decide for the slot that begins at ``state``.

        A repeated request gets the first answer: an agent that moves its plan on by a slot at each call must not
        move it twice for one slot. Raises StateError, UnknownCampaignError, PolicyFaultError.
        """
        session = self._session(campaign_id)
        check_state(session.scenario, state)
        digest = _digest(state)
        with session.lock:
            if session.answered is not None and session.answered[0] == digest:
                return session.answered[1]
            decision = session.agent.decide(state)
            fault = fault_in(session.scenario, decision)
            if fault is not None:
                raise PolicyFaultError(f"{session.agent.name} answered {fault} in slot {state.slot}")
            session.answered = (digest, decision)
            return decision

    def end(self, campaign_id: str) -> None:
        """Forget a campaign."""
        with self._lock:
            self._sessions.pop(campaign_id, None)

    def knows(self, campaign_id: str) -> bool:
        """Has begun, and has not made room for others."""
        with self._lock:
            return campaign_id in self._sessions

    def _session(self, campaign_id: str) -> _Session:
        with self._lock:
            if campaign_id not in self._sessions:
                raise UnknownCampaignError(f"campaign {campaign_id!r} has not begun here")
            self._sessions.move_to_end(campaign_id)
            return self._sessions[campaign_id]


def _digest(state: WorldState) -> bytes:
    arrays = (
        state.uav_pos_enu_m,
        state.uav_vel_enu_mps,
        state.uav_energy_j,
        state.uav_active,
        state.user_pos_enu_m,
        state.user_data_mb,
        state.user_aoi_slots,
        state.user_active,
    )
    return b"|".join([str(state.slot).encode(), *(np.ascontiguousarray(array).tobytes() for array in arrays)])
