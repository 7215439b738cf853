"""Where is flown: missions that open, with their users; and the paper's campuses whose traces are not at hand."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from policy.evaluation.tables.methods import Absent
from policy.mission_file import Mission, MissionError, load_mission, open_campaign, vary
from policy.mobility.reader import DATA_DIR_VARIABLE, find_trace
from policy.mobility.traces import TraceError, UserTraces
from policy.world.scenario import Scenario


@dataclass(frozen=True)
class Campus:
    """A mission under the name that the tables show; opened anew for each fleet and radio, users read once."""

    name: str
    mission: Mission
    slots: int
    _opened: dict[tuple[int, float], tuple[Scenario, UserTraces]] = field(default_factory=dict, compare=False)

    def opened(self, uavs: int, mcl_db: float) -> tuple[Scenario, UserTraces]:
        """The campaign and its users. Raises MissionError where it cannot be flown so."""
        if (uavs, mcl_db) not in self._opened:
            mission = vary(self.mission, uavs=uavs, mcl_db=mcl_db, slots=self.slots)
            scenario, traces = open_campaign(mission)
            if traces is None:
                raise MissionError(f'{mission.source.origin}: users with source = "live" cannot be evaluated; fly it')
            self._opened[uavs, mcl_db] = (scenario, traces)
        return self._opened[uavs, mcl_db]

    def digest(self, uavs: int, mcl_db: float) -> str:
        """SHA-256 of the mission document and of where its users walk."""
        _, traces = self.opened(uavs, mcl_db)
        digest = hashlib.sha256(canonical(self.mission.document).encode())
        digest.update(canonical(list(traces.user_ids)).encode())
        digest.update(np.ascontiguousarray(traces.pos_enu_m, dtype="<f8").tobytes())
        return digest.hexdigest()


def canonical(document: Mapping[str, Any] | Sequence[Any]) -> str:
    """The one JSON text of a document, for digests."""
    return json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=True)


def find_campus(name: str, slots: int | None) -> Campus | Absent:
    """A mission by name or path; ``slots``: None for the mission's own.

    Absent where its trace is not at hand; MissionError where the mission or the trace is wrong.
    """
    mission = load_mission(name)
    if mission.users.kind == "trace":
        try:
            find_trace(mission.users.trace or "", mission.directory)
        except TraceError:
            return Absent(f"its trace {mission.users.trace} is not at hand; {DATA_DIR_VARIABLE} names the folder")
    return Campus(mission.name, mission, slots or mission.scenario.slots)
