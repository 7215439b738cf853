"""Decision times: everyone takes turns, and flies the campaign that it would fly alone."""

import numpy as np
import pytest

from policy.agents.base import Decision
from policy.evaluation.tables.campuses import find_campus
from policy.evaluation.tables.methods import Method
from policy.evaluation.tables.timing import make_timing, time_decisions
from policy.world.state import JointAction

METHODS = [("random", Method("random")), ("plain", Method("receding-horizon"))]
TURNS: list[tuple[str, int]] = []


class Noting:
    """Notes its turns."""

    def __init__(self, label):
        self.name = label

    def reset(self, scenario, seed):
        self.uavs = scenario.num_uavs

    def decide(self, state):
        TURNS.append((self.name, state.slot))
        return Decision(JointAction(np.zeros(self.uavs), np.zeros(self.uavs)))


@pytest.fixture
def campus(tiny):
    return find_campus(str(tiny), None)


def test_methods_take_turns_slot_by_slot(campus, monkeypatch):
    monkeypatch.setattr("policy.agents.registry.POLICIES", {"noting": (__name__, "Noting")})
    TURNS.clear()
    methods = [(name, Method("noting", options=(("label", name),))) for name in ("a", "b")]
    time_decisions(make_timing(campus, methods, slots=3, machine="m"))
    assert TURNS == [("a", 0), ("b", 0), ("a", 1), ("b", 1), ("a", 2), ("b", 2)]


def test_each_method_gets_mean_median_and_tail(campus):
    timing = time_decisions(make_timing(campus, METHODS, slots=4, machine="m"))
    assert (timing["slots"], timing["uavs"], timing["users"]) == (4, 2, 9)
    assert list(timing["methods"]) == ["random", "plain"]
    for spent_ms in timing["methods"].values():
        assert 0.0 < spent_ms["p50"] <= spent_ms["p99"]
        assert 0.0 < spent_ms["processor_p50"] <= spent_ms["p99"]
    assert timing["methods"]["random"]["p50"] < timing["methods"]["plain"]["p50"]


def test_a_time_belongs_to_its_machine_and_its_company(campus):
    keys = {
        make_timing(campus, METHODS, 4, "m").key,
        make_timing(campus, METHODS, 4, "n").key,
        make_timing(campus, METHODS, 5, "m").key,
        make_timing(campus, METHODS[:1], 4, "m").key,
    }
    assert len(keys) == 4


def test_no_more_slots_than_the_campaign_has(campus):
    assert make_timing(campus, METHODS, 1000, "m").slots == campus.slots
