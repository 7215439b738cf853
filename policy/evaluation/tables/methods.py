"""What is compared: methods with their checkpoints and options, and those that cannot be flown here, and why."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass, replace
from pathlib import Path
from typing import Any

from policy.agents.registry import POLICIES, RIVALS, PolicyChoice
from policy.evaluation.learning_curve import CurvePoint, curve_file, read_curve
from policy.model.checkpoint import DEFAULT_NAME, find_checkpoint, read_card
from policy.model.checkpoint_error import CheckpointError
from policy.model.files import SHIPPED, check_digest

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
    by_seed: tuple["Method", ...] = ()  # one training each: seed k flies the k-th, and round again

    def choice(self) -> PolicyChoice:
        """For the registry."""
        return PolicyChoice(self.policy, self.checkpoint, dict(self.options))

    def for_seed(self, seed: int) -> "Method":
        """The one that flies this seed."""
        return self.by_seed[seed % len(self.by_seed)] if self.by_seed else self

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
    trained: tuple[tuple[str, Method], ...] = ()  # campus -> the networks trained on it

    @property
    def policy(self) -> str:
        """Its name in the registry."""
        return self.name if isinstance(self.method, Absent) else self.method.policy

    def on(self, campus: str) -> Method | Absent:
        """What flies there: a network of that campus where the row has one."""
        return dict(self.trained).get(campus, self.method)

    @property
    def all_methods(self) -> tuple[Method | Absent, ...]:
        """Whatever may fly."""
        return (*(method for _, method in self.trained), self.method)


@dataclass(frozen=True)
class Model:
    """A trained network at hand, by what its card says."""

    name: str
    path: str | None  # None: the shipped default
    similarity: str
    use_rgcn: bool
    sha256: str  # of the exported graph, which is what flies
    curve: tuple[CurvePoint, ...] | None = None  # of its training; None where it was not kept

    @property
    def kind(self) -> str:
        """What tells it from networks that are to be compared with it."""
        return self.similarity if self.use_rgcn else f"{self.similarity}, no RGCN"


@dataclass(frozen=True)
class TrainedRival:
    """A rival's network at hand: one training on one mission."""

    policy: str
    mission: str
    seed: int
    path: str
    sha256: str


def find_models(folder: Path | None) -> tuple[Model, ...]:
    """The shipped networks of ``gcrl``, the default first, then those in ``folder`` (one a subfolder).

    Raises CheckpointError for one that is damaged: a table must not silently lack a row.
    """
    default = SHIPPED / DEFAULT_NAME
    stems = [card.with_suffix("") for card in SHIPPED.glob("gcrl-*.json")]
    stems.sort(key=lambda stem: (stem != default, stem))
    shipped = [_model(stem, default=stem == default) for stem in stems]
    own = [path for path in _trained_folders(folder) if _card(path).get("method") not in RIVALS]
    return (*shipped, *(_model(path) for path in own))


def find_rivals(folder: Path | None) -> tuple[TrainedRival, ...]:
    """The rivals' networks in ``folder`` (one a subfolder), by mission and seed; CheckpointError for a damaged one."""
    found = [_rival(path) for path in _trained_folders(folder) if _card(path).get("method") in RIVALS]
    return tuple(sorted(found, key=lambda rival: (rival.policy, rival.mission, rival.seed, rival.path)))


def _trained_folders(folder: Path | None) -> list[Path]:
    return sorted(card.parent for card in folder.glob("*/card.json")) if folder is not None else []


def _card(folder: Path) -> Mapping[str, Any]:
    return read_card(find_checkpoint(folder))


def _rival(folder: Path) -> TrainedRival:
    card, weights = _card(folder), find_checkpoint(folder).weights
    digest = str(card["sha256"].get("safetensors"))
    if not weights.is_file():
        raise CheckpointError(f"{weights}: the trained network is missing beside its model card; copy it along")
    check_digest(weights, digest)
    training = card.get("training")
    if not isinstance(training, dict) or not {"mission", "seed"} <= set(training):
        raise CheckpointError(f"{folder}: its model card says nothing of mission and seed; train it again")
    return TrainedRival(str(card["method"]), str(training["mission"]), int(training["seed"]), str(weights), digest)


def pick(models: Sequence[Model], *, similarity: str = "gaussian", use_rgcn: bool = True) -> Model | None:
    """The first network of that kind."""
    return next((model for model in models if (model.similarity, model.use_rgcn) == (similarity, use_rgcn)), None)


def gcrl(model: Model | None, lacking: str, options: Mapping[str, Any] | None = None) -> Method | Absent:
    """``gcrl`` on a network; ``lacking`` says in the table which one there is none of."""
    if model is None:
        return Absent(f"no checkpoint {lacking}")
    return Method("gcrl", model.path, model.sha256, model.kind, tuple(sorted((options or {}).items())))


def registered(models: Sequence[Model], rivals: Sequence[TrainedRival] = ()) -> tuple[Row, ...]:
    """Every method that this version knows of, in the registry's order."""
    known = [_row(name, models, rivals) for name in POLICIES]
    if "random" in POLICIES:
        known.append(Row(STRAYING, Method("random", options=(("keep_inside", False),))))
    return tuple(known)


def _row(name: str, models: Sequence[Model], rivals: Sequence[TrainedRival]) -> Row:
    if name == "gcrl":
        return Row(name, gcrl(pick(models), "of it is shipped with this version"))
    if name not in RIVALS:
        return Row(name, Method(name))
    own = [rival for rival in rivals if rival.policy == name]
    missions = dict.fromkeys(rival.mission for rival in own)
    trained = tuple((mission, _of_all_seeds(name, [r for r in own if r.mission == mission])) for mission in missions)
    return Row(name, Absent("no network of it trained there is at hand; --checkpoints names the folder"), trained)


def _of_all_seeds(name: str, rivals: Sequence[TrainedRival]) -> Method:
    """Spread over seeds is then over trainings, too."""
    network = f"trained on {rivals[0].mission}"
    one_each = tuple(Method(name, rival.path, rival.sha256, network) for rival in rivals)
    return replace(one_each[0], by_seed=one_each)


def _model(place: Path, *, default: bool = False) -> Model:
    files = find_checkpoint(place)
    card = read_card(files)
    digest = str(card["sha256"].get("onnx"))
    _check_graph(files.graph, digest)
    spec = card.get("spec")
    if not isinstance(spec, dict) or not {"similarity", "use_rgcn"} <= set(spec):
        raise CheckpointError(f"{files.card}: says nothing of the network's similarity and RGCN; train it again")
    curve = read_curve(curve_file(place))
    kept = tuple(curve) if curve else None
    return Model(place.name, None if default else str(place), spec["similarity"], spec["use_rgcn"], digest, kept)


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
