"""Decisions as a service: in this process (``PolicyService``) or over HTTP (``RemotePolicy``), one protocol.

``begin`` a campaign, ``act`` once a slot, ``end`` it. The server side of HTTP is ``python -m policy serve``.
"""

from policy.service.client import RemotePolicy, RemotePolicyError
from policy.service.inprocess import PolicyFaultError, PolicyService, UnknownCampaignError
from policy.service.port import PolicyPort
from policy.service.validity import StateError

__all__ = [
    "PolicyFaultError",
    "PolicyPort",
    "PolicyService",
    "RemotePolicy",
    "RemotePolicyError",
    "StateError",
    "UnknownCampaignError",
]
