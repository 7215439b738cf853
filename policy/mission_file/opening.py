"""Opens a campaign: brings its users from the trace or the generator and gives each a collection rate."""

from dataclasses import replace

import numpy as np

from policy.mission_file.mission import Mission
from policy.mobility.presets import WALKER_PRESETS
from policy.mobility.reader import find_trace, read_traces
from policy.mobility.traces import TraceError, UserTraces
from policy.mobility.walkers import generate_walkers
from policy.world.scenario import Scenario

DEFAULT_PRESET = "campus-dense"


def open_campaign(mission: Mission) -> tuple[Scenario, UserTraces | None]:
    """The scenario with ``collect_mbps`` [M], and the users' places [T+1, M, 2]; None for live users.

    Raises :class:`~policy.mission_file.MissionError` for a trace that is missing or does not fit.
    """
    if mission.users.kind == "live":
        return mission.scenario, None
    traces = _read(mission) if mission.users.kind == "trace" else _walk(mission)
    return _with_users(mission, traces.num_users), traces


def _read(mission: Mission) -> UserTraces:
    scenario = mission.scenario
    try:
        path = find_trace(mission.users.trace or "", mission.directory)
        return read_traces(
            path,
            area_size_m=scenario.area.size_m,
            num_samples=scenario.slots + 1,
            slot_s=scenario.slot_s,
            south_west_deg=scenario.area.south_west_deg,
        )
    except TraceError as error:
        mission.source.fail(("users", "trace"), str(error))


def _walk(mission: Mission) -> UserTraces:
    scenario = mission.scenario
    try:
        return generate_walkers(
            mission.users.walkers,
            scenario.slots + 1,
            scenario.slot_s,
            scenario.area.size_m,
            mission.users.seed,
            params=WALKER_PRESETS[mission.users.preset or DEFAULT_PRESET],
            obstacles=tuple(obstacle.polygon_m for obstacle in scenario.area.obstacles),
        )
    except ValueError as error:  # an area so full of obstacles that nobody has room
        mission.source.fail(("users", "source"), str(error))


def _with_users(mission: Mission, num_users: int) -> Scenario:
    rates = mission.scenario.collect_mbps
    if len(rates) not in (1, num_users):
        mission.source.fail(
            ("users", "collect_mbps"), f"has {len(rates)} values for {num_users} users; give one, or one a user"
        )
    return replace(mission.scenario, collect_mbps=np.array(np.broadcast_to(rates, (num_users,))))
