"""What is compared: methods with their checkpoints and options, and those that cannot be flown here, and why."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass, replace
from pathlib import Path
from typing import Any

from policy.agents.registry import LEARNED, PLANNED, POLICIES, PolicyChoice
from policy.model.checkpoint import DEFAULT_NAME, CheckpointFiles, find_checkpoint, read_card
from policy.model.checkpoint_error import CheckpointError
from policy.model.files import SHIPPED, check_digest, sha256

STRAYING = "random, may leave the map"
"""The paper's Random draws from all nine actions; ours draws from those that stay inside."""


@dataclass(frozen=True)
class Method:
    """A policy, its checkpoint and its constructor's options: all that tells one method's flights from another's."""

    policy: str
    checkpoint: str | None = None  # path; None: the shipped default, or a method that does not learn
    checkpoint_sha256: str | None = None
    network: str | None = None  # what kind of network the checkpoint holds
    options: tuple[tuple[str, Any], ...] = ()  # frozen values, so that methods can be told apart and sent to workers

    def choice(self) -> PolicyChoice:
        """For the registry."""
        return PolicyChoice(self.policy, self.checkpoint, dict(self.options))

    def document(self) -> dict[str, Any]:
        """As JSON, without the path: the same weights elsewhere are the same method."""
        options = {name: asdict(value) if is_dataclass(value) else value for name, value in self.options}  # type: ignore[arg-type]
        return {
            "policy": self.policy,
            "network": self.network,
            "checkpoint_sha256": self.checkpoint_sha256,
            "options": options,
        }


@dataclass(frozen=True)
class Absent:
    """What cannot be flown here, and why: shown in the tables, never made up."""

    reason: str


@dataclass(frozen=True)
class Row:
    """A line of a table: its name and what flies it."""

    name: str
    method: Method | Absent

    @property
    def policy(self) -> str:
        """Its name in the registry."""
        return self.name if isinstance(self.method, Absent) else self.method.policy


@dataclass(frozen=True)
class Model:
    """A trained network at hand, by what its card says."""

    name: str
    path: str | None  # None: the shipped default
    similarity: str
    use_rgcn: bool
    sha256: str  # of the exported graph, which is what flies

    @property
    def kind(self) -> str:
        """What tells it from networks that are to be compared with it."""
        return self.similarity if self.use_rgcn else f"{self.similarity}, no RGCN"


def find_models(folder: Path | None) -> tuple[Model, ...]:
    """The shipped networks of ``gcrl``, the default first, then those in ``folder`` (one a subfolder).

    Raises CheckpointError for one that is damaged: a table must not silently lack a row.
    """
    default = SHIPPED / DEFAULT_NAME
    stems = [card.with_suffix("") for card in SHIPPED.glob("gcrl-*.json")]
    stems.sort(key=lambda stem: (stem != default, stem))
    shipped = [_model(stem, default=stem == default) for stem in stems]
    own = sorted(card.parent for card in folder.glob("*/card.json")) if folder is not None else []
    return (*shipped, *(_model(path) for path in own))


def pick(models: Sequence[Model], *, similarity: str = "gaussian", use_rgcn: bool = True) -> Model | None:
    """The first network of that kind."""
    return next((model for model in models if (model.similarity, model.use_rgcn) == (similarity, use_rgcn)), None)


def gcrl(model: Model | None, lacking: str, options: Mapping[str, Any] | None = None) -> Method | Absent:
    """``gcrl`` on a network; ``lacking`` says in the table which one there is none of."""
    if model is None:
        return Absent(f"no checkpoint {lacking}")
    return Method("gcrl", model.path, model.sha256, model.kind, tuple(sorted((options or {}).items())))


def registered(models: Sequence[Model]) -> tuple[Row, ...]:
    """Every method that this version knows of, in the registry's order, then those that are yet to come."""
    known = [Row(name, _registered(name, models)) for name in POLICIES]
    if "random" in POLICIES:
        known.append(Row(STRAYING, Method("random", options=(("keep_inside", False),))))
    return (*known, *(Row(name, Absent("not in this version")) for name in PLANNED if name not in POLICIES))


def _registered(name: str, models: Sequence[Model]) -> Method | Absent:
    if name == "gcrl":
        return gcrl(pick(models), "of it is shipped with this version")
    if name in LEARNED:
        return _learned(name)
    return Method(name)


def _learned(name: str) -> Method | Absent:
    """Another learned method, on the weights that ship under its name."""
    weights = CheckpointFiles.named(SHIPPED / f"{name}-default").weights
    if not weights.is_file():
        return Absent("no checkpoint of it is shipped with this version")
    return Method(name, str(weights), sha256(weights))


def _model(place: Path, *, default: bool = False) -> Model:
    files = find_checkpoint(place)
    card = read_card(files)
    digest = str(card["sha256"].get("onnx"))
    _check_graph(files.graph, digest)
    spec = card.get("spec")
    if not isinstance(spec, dict) or not {"similarity", "use_rgcn"} <= set(spec):
        raise CheckpointError(f"{files.card}: says nothing of the network's similarity and RGCN; train it again")
    return Model(place.name, None if default else str(place), spec["similarity"], spec["use_rgcn"], digest)


def _check_graph(graph: Path, digest: str) -> None:
    """Raise CheckpointError unless the exported graph is there and the one that its card was written for."""
    if not graph.is_file():
        raise CheckpointError(f"{graph}: the exported network is missing beside its model card; copy it along")
    check_digest(graph, digest)


def with_options(method: Method | Absent, **options: Any) -> Method | Absent:
    """The same method under other options; what is absent stays so."""
    if isinstance(method, Absent):
        return method
    return replace(method, options=tuple(sorted({**dict(method.options), **options}.items())))
