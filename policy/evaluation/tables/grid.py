"""Which campaigns each table and figure stands on."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from policy.agents.gcrl import GcrlSettings
from policy.evaluation.tables.cells import Point
from policy.evaluation.tables.methods import (
    Absent,
    Method,
    Model,
    Row,
    TrainedRival,
    gcrl,
    pick,
    registered,
    with_options,
)
from policy.model.spec import SIMILARITIES
from policy.search.next_state import NEXT_STATES

SECTIONS = (
    *("table1", "table2", "table3", "nextstate", "methods", "uavs", "mcl"),
    *("trajectories", "relations", "curves"),
)
"""Table I-III; the search on exact and learned next states; all methods at U = 2 and 117 dB; Figures 4, 6, 8;
Figures 5, 7, 9; Figure 3; Figure 2; learning curves."""
BASE_UAVS = 2
BASE_MCL_DB = 117.0
QUICK_SLOTS = 20
PAPER_DEPTH = 3
"""N of the paper's Table III."""
PLAIN = "receding-horizon"
"""The plain planner, what a user would pick instead, stands beside the ablations."""


@dataclass(frozen=True)
class Extent:
    """How much is flown."""

    seeds: int
    slots: int | None = None  # None: each mission's own
    depths: tuple[int, ...] = (2, 3, 4, 5)  # N of Table I
    uavs: tuple[int, ...] = (2, 3, 5, 7, 9, 11)
    mcl_db: tuple[float, ...] = (115.0, 117.0, 119.0, 121.0, 123.0)
    timed_slots: int = 60

    @classmethod
    def quick(cls, seeds: int) -> "Extent":
        """Minutes instead of hours: shows that everything runs; too short to be set beside the paper."""
        return cls(seeds, QUICK_SLOTS, (2, 3), (2, 3), (117.0, 119.0), QUICK_SLOTS // 2)


@dataclass(frozen=True)
class Similar:
    """A line of Table I."""

    similarity: str
    depth: int
    method: Method | Absent


@dataclass(frozen=True)
class Grid:
    """The rows of each table, for the campuses at hand."""

    sections: tuple[str, ...]
    campuses: tuple[str, ...]
    extent: Extent
    methods: tuple[Row, ...]
    similarities: tuple[Similar, ...]
    ablations: tuple[Row, ...]
    tree_ablations: tuple[Row, ...] = ()  # the same of the paper's own search
    next_states: tuple[Row, ...] = ()
    networks: tuple[Model, ...] = ()  # all at hand, for their learning curves

    @property
    def attending(self) -> Method | Absent:
        """The network whose relation weights are drawn: that of the default ``gcrl``."""
        left_out = Absent("`gcrl` is not among --policies")
        return next((row.method for row in self.methods if row.policy == "gcrl"), left_out)

    def points(self) -> tuple[Point, ...]:
        """All that is flown in campaigns, each once, nearest to the paper's tables first."""
        return tuple(dict.fromkeys(point for section in self.sections for point in self._section(section)))

    def _section(self, section: str) -> Iterator[Point]:
        base = ((BASE_UAVS, BASE_MCL_DB),)
        if section == "table1":
            yield from self._at(base, lambda _: (line.method for line in self.similarities))
        elif section == "table3":
            yield from self._at(
                base, lambda campus: (row.on(campus) for row in (*self.ablations, *self.tree_ablations))
            )
        elif section == "nextstate":
            yield from self._at(base, lambda campus: (row.on(campus) for row in self.next_states))
        elif section in ("methods", "trajectories"):
            yield from self._at(base, self._everyone)
        elif section in ("uavs", "mcl"):
            yield from self._at(axis(section, self.extent), self._everyone)

    def _everyone(self, campus: str) -> Iterator[Method | Absent]:
        return (row.on(campus) for row in self.methods)

    def _at(
        self, places: Sequence[tuple[int, float]], methods: Callable[[str], Iterator[Method | Absent]]
    ) -> Iterator[Point]:
        for campus in self.campuses:
            for uavs, mcl_db in places:
                yield from (Point(campus, method, uavs, mcl_db) for method in _present(methods(campus)))


def axis(section: str, extent: Extent) -> tuple[tuple[int, float], ...]:
    """(U, MCL) along the figures' horizontal axis."""
    if section == "uavs":
        return tuple((uavs, BASE_MCL_DB) for uavs in extent.uavs)
    return tuple((BASE_UAVS, mcl_db) for mcl_db in extent.mcl_db)


def make_grid(
    sections: Sequence[str],
    campuses: Sequence[str],
    extent: Extent,
    models: Sequence[Model],
    only: Sequence[str] = (),
    rivals: Sequence[TrainedRival] = (),
) -> Grid:
    """``only``: names of the policies to compare; empty for all."""
    methods = tuple(row for row in registered(models, rivals) if not only or row.policy in only)
    with_gcrl = not only or "gcrl" in only
    return Grid(
        sections=tuple(sections),
        campuses=tuple(campuses),
        extent=extent,
        methods=methods,
        similarities=_similarities(models, extent.depths) if with_gcrl else (),
        ablations=_ablations(models) if with_gcrl else (),
        tree_ablations=_tree_ablations(models) if with_gcrl else (),
        next_states=_next_states(models) if with_gcrl else (),
        networks=tuple(models) if with_gcrl else (),
    )


def _similarities(models: Sequence[Model], depths: Sequence[int]) -> tuple[Similar, ...]:
    """The paper's own search (nine actions, depth N) on networks of each similarity."""
    networks = {kind: gcrl(pick(models, similarity=kind), f"with {kind} similarity") for kind in SIMILARITIES}
    return tuple(
        Similar(kind, depth, with_options(network, settings=GcrlSettings.paper(depth)))
        for kind, network in networks.items()
        for depth in depths
    )


def _ablations(models: Sequence[Model]) -> tuple[Row, ...]:
    """The default search, less one part or two."""
    whole = gcrl(pick(models), "of it")
    without_rgcn = gcrl(pick(models, use_rgcn=False), "without RGCN")
    stay = GcrlSettings(use_prediction=False)
    return (
        Row("gcrl", whole),
        Row("w/o RGCN", without_rgcn),
        Row("w/o pred", with_options(whole, settings=stay)),
        Row("w/o RGCN, pred", with_options(without_rgcn, settings=stay)),
        Row(PLAIN, Method(PLAIN)),
    )


def _tree_ablations(models: Sequence[Model]) -> tuple[Row, ...]:
    """The paper's own search, less one part or two: without prediction on the world's physics, with users that stay."""
    whole = gcrl(pick(models), "of it")
    without_rgcn = gcrl(pick(models, use_rgcn=False), "without RGCN")
    predicted, stay = GcrlSettings.paper(PAPER_DEPTH), GcrlSettings.paper(PAPER_DEPTH, "exact")
    return (
        Row("gcrl", with_options(whole, settings=predicted)),
        Row("w/o RGCN", with_options(without_rgcn, settings=predicted)),
        Row("w/o pred", with_options(whole, settings=stay)),
        Row("w/o RGCN, pred", with_options(without_rgcn, settings=stay)),
    )


def _next_states(models: Sequence[Model]) -> tuple[Row, ...]:
    """The paper's own search, its next states by the world's physics, learned, or each where it is best."""
    network = gcrl(pick(models), "of it")
    return tuple(
        Row(kind, with_options(network, settings=GcrlSettings.paper(PAPER_DEPTH, kind))) for kind in NEXT_STATES
    )


def _present(methods: "Iterator[Method | Absent]") -> tuple[Method, ...]:
    return tuple(method for method in methods if isinstance(method, Method))
