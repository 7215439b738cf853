"""Seconds of a campaign by method and number of UAVs, and from these the cost of all that is flown in campaigns."""

import itertools
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from sweep_estimate import estimate, length, table

from policy.agents.registry import RIVALS
from policy.evaluation.tables.campuses import Campus
from policy.evaluation.tables.cells import Point
from policy.evaluation.tables.grid import BASE_MCL_DB, Extent, Grid, make_grid
from policy.evaluation.tables.methods import Absent, Method, find_models, find_rivals
from policy.mobility.feed import TraceFeed
from policy.model.checkpoint import find_checkpoint, read_card
from policy.world.state import initial_state
from policy.world.transition import step

SEEDS = 5
WARM_SLOTS, SLOTS, BUDGET_S = 3, 10, 0.5
"""A method is timed over so many slots after those that warm it up, or fewer when it has taken so long."""
FLOWN = ("methods", "uavs", "mcl", "table1", "table3", "nextstate")
"""All that is flown in campaigns; Figure 3 takes those of `methods`."""


@dataclass(frozen=True)
class Cell:
    """What a point's campaigns cost, each."""

    point: Point
    name: str
    seconds: float


def grid_cost(campuses: Mapping[str, Campus], checkpoints: Path | None) -> str:
    """Markdown: by method, the whole, and the whole on so many cores. The processor's seconds, not the clock's."""
    extent = Extent(SEEDS)
    grid = make_grid(FLOWN, tuple(campuses), extent, find_models(checkpoints), (), find_rivals(checkpoints))
    cells = list(_cells(grid, campuses))
    trainings, unknown = _trainings_s(checkpoints, len(campuses) * SEEDS)
    jobs_s = [cell.seconds for cell in cells for _ in range(SEEDS)]
    left_out = [row.name for row in grid.methods if any(isinstance(row.on(name), Absent) for name in campuses)]
    stages = {"trainings": sorted(itertools.chain(*trainings.values()), reverse=True), "campaigns": jobs_s}
    notes = [
        *(f"- `{name}`: a training {length(jobs[0])}, {len(jobs)} of them" for name, jobs in trainings.items()),
        *(f"- `{name}`: no training on one thread of a CPU at hand, so none is counted" for name in unknown),
        *(f"- `{name}`: left out, its networks are not at hand" for name in left_out),
        *(
            f"- all {name}: {len(jobs)}, {length(sum(jobs))}, the longest {length(max(jobs))}"
            for name, jobs in stages.items()
            if jobs
        ),
    ]
    head = ["a campaign of", *(f"U = {uavs}" for uavs in extent.uavs), "campaigns", "together"]
    by_cores = table(["cores", "the whole", "of them at work"], estimate(stages))
    return "\n".join([table(head, _rows(cells, extent)), *notes, "", by_cores])


def _cells(grid: Grid, campuses: Mapping[str, Campus]) -> Iterator[Cell]:
    """Each method is timed once a campus and number of UAVs; the radio is taken to make no difference to its work."""
    names = _names(grid, campuses)
    known: dict[tuple[str, Method, int], float] = {}
    for point in grid.points():
        asked = (point.campus, point.method, point.uavs)
        if asked not in known:
            known[asked] = campaign_s(campuses[point.campus], point.method, point.uavs)
            print(f"{point.method.policy}, {point.campus}, U = {point.uavs}: {known[asked]:.2f} s", file=sys.stderr)
        yield Cell(point, names[point.method], known[asked])


def _names(grid: Grid, campuses: Mapping[str, Campus]) -> dict[Method | Absent, str]:
    """A row for each method, and one for each depth of the paper's search: the similarity makes no other work."""
    names: dict[Method | Absent, str] = {
        line.method: f"the paper's search, N = {line.depth}" for line in grid.similarities
    }
    for rows, name in (
        (grid.next_states, "the paper's search, {} next states"),
        (grid.ablations, "{}"),
        (grid.tree_ablations, "the paper's search, {}"),
    ):
        for row in rows:
            names.setdefault(row.method, name.format(row.name))
    return names | {row.on(campus): row.name for row in grid.methods for campus in campuses}


def campaign_s(campus: Campus, method: Method, uavs: int) -> float:
    """Of the processor, for a whole campaign: measured over some of its slots, after the first few."""
    scenario, users = campus.opened(uavs, BASE_MCL_DB)
    places, agent = TraceFeed(users).as_places(), method.for_seed(0).choice().build()
    agent.reset(scenario, 0)
    state = initial_state(scenario, places.positions(0))
    begun_s, last = 0.0, min(WARM_SLOTS + SLOTS, campus.slots) - 1
    for slot in range(last + 1):
        state, _ = step(scenario, state, agent.decide(state).action, places.positions(slot + 1))
        if slot + 1 == WARM_SLOTS:
            begun_s = time.process_time()
        elif slot >= WARM_SLOTS and (slot == last or time.process_time() - begun_s > BUDGET_S):
            return (time.process_time() - begun_s) / (slot + 1 - WARM_SLOTS) * campus.slots
    raise ValueError(f"{campus.name}: {campus.slots} slots are too few to be timed, {WARM_SLOTS + 1} are needed")


def _rows(cells: list[Cell], extent: Extent) -> Iterator[tuple[str, ...]]:
    for name in dict.fromkeys(cell.name for cell in cells):
        own = [cell for cell in cells if cell.name == name]
        by_uavs = [[cell.seconds for cell in own if cell.point.uavs == uavs] for uavs in extent.uavs]
        means = (f"{sum(seconds) / len(seconds):.2f} s" if seconds else "" for seconds in by_uavs)
        yield name, *means, str(SEEDS * len(own)), length(SEEDS * sum(cell.seconds for cell in own))


def _trainings_s(checkpoints: Path | None, each: int) -> tuple[dict[str, list[float]], list[str]]:
    """By method, ``each`` times the mean of what its model cards say; and the methods whose cards cannot tell."""
    known = {}
    for policy in sorted(RIVALS):
        own = [
            read_card(find_checkpoint(Path(rival.path).parent))
            for rival in find_rivals(checkpoints)
            if rival.policy == policy
        ]
        on_one = [
            float(card["processor_s"])
            for card in own
            if card["device"] == "cpu" and card["training"]["threads"] == 1 and "processor_s" in card
        ]
        if on_one:
            known[policy] = [sum(on_one) / len(on_one)] * each
    return known, sorted(RIVALS - known.keys())
