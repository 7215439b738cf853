"""Methods by name. A method's module is imported when it is asked for, so that one that needs torch does not
burden those that do not.
"""

import difflib
import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

from policy.agents.base import Agent

POLICIES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "gcrl": ("policy.agents.gcrl", "GcrlAgent"),
        "receding-horizon": ("policy.agents.receding_horizon", "RecedingHorizonAgent"),
        "random": ("policy.agents.uniform", "UniformAgent"),
        "drl-freshmcs": ("policy.agents.drl_freshmcs", "DrlFreshMcsAgent"),
        "muzero": ("policy.agents.muzero", "MuzeroAgent"),
        "acktr": ("policy.agents.acktr", "AcktrAgent"),
        "aoi-drqn": ("policy.agents.aoi_drqn", "AoiDrqnAgent"),
    }
)
"""Name -> module and class of what can be flown."""

RIVALS = frozenset({"drl-freshmcs", "muzero", "acktr", "aoi-drqn"})
"""The paper's learned baselines: they need torch, and a network of one's own training."""

LEARNED = frozenset({"gcrl"}) | RIVALS
"""Methods that read a checkpoint."""


class UnknownPolicyError(ValueError):
    """A policy name or option that this version cannot serve: one line."""


@dataclass(frozen=True)
class PolicyChoice:
    """Which method flies, with its checkpoint and its constructor's options."""

    name: str
    checkpoint: str | None = None
    options: Mapping[str, Any] = field(default_factory=dict)

    def build(self) -> Agent:
        """A fresh agent of this choice; raises as :func:`make_agent`."""
        return make_agent(self.name, checkpoint=self.checkpoint, **self.options)


def policy_names() -> tuple[str, ...]:
    """What can be flown."""
    return tuple(POLICIES)


def check_name(name: str) -> None:
    """Raise :class:`UnknownPolicyError` unless ``name`` can be flown."""
    if name in POLICIES:
        return
    known = ", ".join(POLICIES)
    near = difflib.get_close_matches(name, POLICIES, n=1)
    hint = f'did you mean "{near[0]}"? ' if near else ""
    raise UnknownPolicyError(f'unknown policy "{name[:60]}"; {hint}choose one of: {known}')


def make_agent(name: str, *, checkpoint: str | None = None, **options: Any) -> Agent:
    """A fresh agent. ``checkpoint`` only for methods that learn; ``options`` go to the method's constructor.

    Raises :class:`UnknownPolicyError`; a learned method's own CheckpointError passes through.
    """
    check_name(name)
    if checkpoint is not None:
        if name not in LEARNED:
            raise UnknownPolicyError(f'policy "{name}" does not learn and takes no checkpoint; leave it out')
        if name in RIVALS:
            options["checkpoint"] = Path(checkpoint)
        else:
            options["evaluator"] = _evaluator(Path(checkpoint))
    return cast("Agent", agent_type(name)(**options))


def agent_type(name: str) -> Any:
    """The class behind a name; :class:`UnknownPolicyError` where what it needs is not installed."""
    module_name, class_name = POLICIES[name]
    try:
        return getattr(importlib.import_module(module_name), class_name)
    except ImportError as error:
        if name in RIVALS and (error.name or "").partition(".")[0] == "torch":
            raise UnknownPolicyError(
                f"policy \"{name}\" needs the [train] extra: pip install 'uav-crowdsensing[train]'"
            ) from error
        raise


def _evaluator(path: Path) -> Any:
    """The trained networks, run by onnxruntime."""
    return importlib.import_module("policy.model.checkpoint").load_evaluator(path)
