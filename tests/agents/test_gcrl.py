"""The agent with the shipped checkpoint: no torch, no future, and an answer that says why."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from policy.agents.gcrl import EXPLAINED_USERS, GcrlAgent, GcrlSettings
from policy.evaluation.rollout import fly
from policy.model.checkpoint import find_checkpoint
from policy.model.evaluator import NetworkEvaluator
from policy.model.forecast_file import load_forecaster
from policy.model.onnx_runner import OnnxRunner
from policy.search.settings import SearchSettings
from policy.world.airspace import legal_moves
from policy.world.arrays import FloatArray
from policy.world.scenario import Area, Scenario
from policy.world.state import initial_state

NARROW = GcrlSettings(search=SearchSettings(horizon_slots=4, beam=8), use_value=True)
SLOTS = 12


def campaign(uavs: int = 2, users: int = 15, seed: int = 0) -> tuple[Scenario, FloatArray]:
    rng = np.random.default_rng(seed)
    area = Area((0.0, 0.0), (1600.0, 1200.0))
    launch = np.tile([800.0, 600.0], (uavs, 1))
    scenario = Scenario(area, launch, np.full(users, 0.02), slots=SLOTS)
    walk = np.cumsum(rng.normal(0.0, 15.0, (SLOTS + 1, users, 2)), axis=0)
    return scenario, np.clip(rng.uniform(0.0, (1600.0, 1200.0), (users, 2)) + walk, 0.0, (1600.0, 1200.0))


class Places:
    def __init__(self, pos_enu_m: FloatArray) -> None:
        self._pos_enu_m = pos_enu_m

    def positions(self, sample: int) -> FloatArray:
        return self._pos_enu_m[sample]


def flown(settings: GcrlSettings, pos_enu_m: FloatArray, scenario: Scenario) -> tuple[FloatArray, FloatArray]:
    record = fly(scenario, Places(pos_enu_m), GcrlAgent(settings))
    return np.stack(record.heading_rad), np.stack(record.speed_mps)


def test_it_flies_without_torch() -> None:
    """The base install has none: importing, loading and deciding must not ask for it."""
    program = """
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("torch", "onnx", "onnxscript", "tensorboard"):
            raise ModuleNotFoundError(f"No module named {name!r} in the base install")
sys.meta_path.insert(0, Blocked())
import numpy as np
from policy.agents.gcrl import GcrlAgent
from policy.world.scenario import Area, Scenario
from policy.world.state import initial_state
scenario = Scenario(Area((0.0, 0.0), (900.0, 900.0)), np.full((1, 2), 450.0), np.full(3, 0.02))
agent = GcrlAgent()
agent.reset(scenario, 0)
assert agent.decide(initial_state(scenario, np.full((3, 2), 100.0))).action.speed_mps.shape == (1,)
assert "torch" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr


def test_the_future_of_the_trace_changes_no_decision() -> None:
    scenario, pos_enu_m = campaign()
    heading, speed = flown(NARROW, pos_enu_m, scenario)
    seen = 6
    scrambled = pos_enu_m.copy()
    scrambled[seen + 1 :] = scrambled[seen + 1 :][:, np.random.default_rng(1).permutation(pos_enu_m.shape[1])]
    other_heading, other_speed = flown(NARROW, scrambled, scenario)
    np.testing.assert_array_equal(heading[: seen + 1], other_heading[: seen + 1])
    np.testing.assert_array_equal(speed[: seen + 1], other_speed[: seen + 1])
    assert not np.array_equal(heading[seen + 1 :], other_heading[seen + 1 :])


def test_it_decides_alike_every_time_and_legally() -> None:
    scenario, pos_enu_m = campaign()
    scenario = scenario.with_accel(4.5)
    record = fly(scenario, Places(pos_enu_m), GcrlAgent(NARROW))
    again, _ = flown(NARROW, pos_enu_m, scenario)
    np.testing.assert_array_equal(np.stack(record.heading_rad), again)
    assert sum(record.violations.values()) == 0


@pytest.mark.parametrize("uavs", [1, 3])
def test_it_tells_why(uavs: int) -> None:
    scenario, pos_enu_m = campaign(uavs)
    agent = GcrlAgent(replace(NARROW, search=SearchSettings(horizon_slots=2, beam=100)))
    agent.reset(scenario, 0)
    decision = agent.decide(initial_state(scenario, pos_enu_m[0]))
    told = json.loads(json.dumps(dict(decision.explanation), allow_nan=False))
    assert len(told["relations"]) == uavs
    for row in told["relations"]:
        weights = [user["weight"] for user in row]
        assert len(row) == EXPLAINED_USERS
        assert weights == sorted(weights, reverse=True)
        assert 0.0 <= sum(weights) <= 1.0
    assert np.asarray(told["predicted_user_enu_m"]).shape == (scenario.num_users, 2)
    assert [uav["uav"] for uav in told["uavs"]] == list(range(uavs))
    assert all(uav["alternatives"] for uav in told["uavs"])


def test_each_learned_part_can_be_switched_off_and_matters() -> None:
    scenario, pos_enu_m = campaign()
    variants = [
        NARROW,
        replace(NARROW, use_value=False),
        replace(NARROW, use_prediction=False),
        replace(NARROW, use_forecast=False),
        replace(NARROW, use_forecast=False, blur_share=0.0),
    ]
    plain = NARROW.without_network()
    assert not plain.use_value
    assert not plain.use_prediction
    headings = [flown(settings, pos_enu_m, scenario)[0] for settings in (*variants, plain)]
    for i, one in enumerate(headings):
        assert all(not np.array_equal(one, other) for other in headings[:i])


def test_the_papers_variant_flies_its_nine_actions() -> None:
    scenario, pos_enu_m = campaign()
    heading, speed = flown(GcrlSettings.paper(), pos_enu_m, scenario)
    assert set(np.unique(speed)) <= {0.0, 18.0}
    assert np.allclose(np.degrees(heading) % 45.0, 0.0)


def test_it_goes_on_when_users_and_uavs_drop_out() -> None:
    scenario, pos_enu_m = campaign(uavs=2)
    agent = GcrlAgent(NARROW)
    agent.reset(scenario, 0)
    state = initial_state(scenario, pos_enu_m[0])
    agent.decide(state)
    fewer = replace(
        state,
        slot=1,
        uav_active=np.array([True, False]),
        user_active=np.arange(scenario.num_users) % 2 == 0,
        user_pos_enu_m=pos_enu_m[1],
    )
    action = agent.decide(fewer).action
    legal = legal_moves(fewer.uav_pos_enu_m, fewer.uav_vel_enu_mps, action.vel_enu_mps, scenario)
    assert legal[0]
    assert action.speed_mps[1] == 0.0
    nobody = replace(fewer, slot=2, user_active=np.zeros(scenario.num_users, dtype=np.bool_))
    assert np.all(np.isfinite(agent.decide(nobody).action.speed_mps))


def test_it_must_be_told_its_campaign_first() -> None:
    scenario, pos_enu_m = campaign()
    with pytest.raises(RuntimeError, match="reset"):
        GcrlAgent(NARROW).decide(initial_state(scenario, pos_enu_m[0]))


def test_a_given_evaluator_is_asked() -> None:
    class Counting(NetworkEvaluator):
        calls = 0

        def value(self, states, units):  # type: ignore[no-untyped-def]
            Counting.calls += 1
            return super().value(states, units)

    scenario, pos_enu_m = campaign()
    agent = GcrlAgent(NARROW, Counting(OnnxRunner(find_checkpoint(None).graph), load_forecaster()))
    agent.reset(scenario, 0)
    agent.decide(initial_state(scenario, pos_enu_m[0]))
    assert Counting.calls > 0
