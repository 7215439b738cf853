"""The shape of a network: what a checkpoint must agree on before its weights are used."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from policy.model.features import FEATURE_VERSION

SIMILARITIES = ("gaussian", "cosine", "square")
"""Embedded Gaussian (the paper's choice, Eq. 11d), cosine and square: Table I."""


@dataclass(frozen=True)
class ModelSpec:
    """Widths and switches of the network; ``use_rgcn=False`` is the ablation of Table III."""

    width: int = 32  # of z and eta, Eq. 11
    layers: int = 2  # L, Eq. 11e
    similarity: str = "gaussian"
    use_rgcn: bool = True
    gamma: float = 0.9  # of the value: with the paper's 0.95 the far tail, the same for all leaves, drowns what differs
    feature_version: int = FEATURE_VERSION

    def __post_init__(self) -> None:
        if self.similarity not in SIMILARITIES:
            raise ValueError(f"similarity {self.similarity!r} is unknown: choose one of {', '.join(SIMILARITIES)}")
        if self.feature_version != FEATURE_VERSION:
            raise ValueError(
                f"the network reads features of version {self.feature_version}, this version gives {FEATURE_VERSION}"
            )
        if self.width < 1 or self.layers < 0 or not 0.0 < self.gamma < 1.0:
            raise ValueError(f"no network has width {self.width}, {self.layers} layers and gamma {self.gamma}")

    def to_json(self) -> dict[str, Any]:
        """For the model card."""
        return asdict(self)

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> "ModelSpec":
        """From a model card; ValueError names a key that is missing or unknown."""
        names = {f.name for f in fields(cls)}
        if set(document) != names:
            raise ValueError(f"the network's description has keys {sorted(document)} instead of {sorted(names)}")
        for f in fields(cls):
            if type(document[f.name]) is not type(getattr(cls, f.name)):
                raise ValueError(f"{f.name} must be a {type(getattr(cls, f.name)).__name__}")
        return cls(**document)
