"""The service in process: one agent a campaign, idempotent, safe from several threads."""

import json
import threading
from dataclasses import replace

import numpy as np
import pytest

from policy.agents.base import Decision
from policy.agents.registry import PolicyChoice, UnknownPolicyError
from policy.service import PolicyFaultError, PolicyService, StateError, UnknownCampaignError
from policy.service.validity import fault_in
from policy.service.wire import DecisionWire, decision_document, decision_from
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState
from policy.world.transition import step

RANDOM = PolicyChoice("random")


class Fixed:
    """An agent that always answers the same."""

    name = "fixed"

    def __init__(self, heading_rad, speed_mps) -> None:
        self.action = JointAction(np.asarray(heading_rad), np.asarray(speed_mps))

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Nothing to begin."""

    def decide(self, state: WorldState) -> Decision:
        return Decision(self.action)


class Answers(PolicyChoice):
    """A choice that builds the given agent."""

    agent = Fixed([0.0, 0.0], [0.0, 0.0])

    def build(self) -> Fixed:
        return self.agent


def test_a_campaign_gets_decisions_that_can_be_flown(scenario, state):
    service = PolicyService()
    service.begin("c", scenario, PolicyChoice("receding-horizon"))
    for _ in range(scenario.slots):
        decision = service.act("c", state)
        assert np.all(decision.action.speed_mps <= scenario.max_speed_mps)
        state, outcome = step(scenario, state, decision.action, state.user_pos_enu_m)
        assert not np.any(outcome.left_area | outcome.hit_obstacle)


def test_a_repeated_request_gets_the_first_answer(scenario, state):
    service = PolicyService()
    service.begin("c", scenario, RANDOM, seed=4)
    first = service.act("c", state)
    assert service.act("c", state) is first
    fresh = PolicyService()
    fresh.begin("c", scenario, RANDOM, seed=4)
    assert np.array_equal(fresh.act("c", state).action.heading_rad, first.action.heading_rad)


def test_campaigns_do_not_share_agents(scenario, state):
    service, alone = PolicyService(), PolicyService()
    for name in ("a", "b"):
        service.begin(name, scenario, RANDOM, seed=4)
    alone.begin("a", scenario, RANDOM, seed=4)
    for slot in range(5):
        now = replace(state, slot=slot)
        service.act("b", now)
        assert np.array_equal(service.act("a", now).action.heading_rad, alone.act("a", now).action.heading_rad)


def test_unknown_and_ended_campaigns(scenario, state):
    service = PolicyService(max_campaigns=2)
    with pytest.raises(UnknownCampaignError):
        service.act("c", state)
    for name in "abc":
        service.begin(name, scenario, RANDOM)
    assert [service.knows(name) for name in "abc"] == [False, True, True]
    service.end("b")
    service.end("b")
    assert not service.knows("b")
    with pytest.raises(UnknownPolicyError):
        service.begin("d", scenario, PolicyChoice("none"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"uav_pos_enu_m": np.zeros((3, 2))}, "uav_pos_enu_m: has shape"),
        ({"user_aoi_slots": np.full(4, np.nan)}, "user_aoi_slots: holds NaN"),
        ({"user_data_mb": np.full(4, -1.0)}, "user_data_mb: is negative"),
        ({"uav_pos_enu_m": np.full((2, 2), 1e7)}, "south-west corner"),
        ({"slot": 8}, "slots 0 to 7"),
        ({"slot": -1}, "slots 0 to 7"),
    ],
)
def test_a_state_that_does_not_fit_is_refused(scenario, state, change, words):
    service = PolicyService()
    service.begin("c", scenario, RANDOM)
    with pytest.raises(StateError, match=words):
        service.act("c", replace(state, **change))


@pytest.mark.parametrize(
    ("heading_rad", "speed_mps"),
    [([0.0], [1.0]), ([0.0, np.nan], [1.0, 1.0]), ([0.0, 0.0], [1.0, 19.0]), ([0.0, 0.0], [-1.0, 0.0])],
)
def test_an_answer_that_cannot_be_flown_is_a_fault(scenario, state, heading_rad, speed_mps):
    class Broken(Answers):
        agent = Fixed(heading_rad, speed_mps)

    service = PolicyService()
    service.begin("c", scenario, Broken("fixed"))
    with pytest.raises(PolicyFaultError, match="fixed answered"):
        service.act("c", state)


def test_many_threads_on_few_campaigns(scenario, state):
    service = PolicyService()
    for name in "ab":
        service.begin(name, scenario, RANDOM, seed=2)
    answers: dict[tuple[str, int], list[bytes]] = {}
    guard = threading.Lock()

    def ask(name: str) -> None:
        decision = service.act(name, state)
        with guard:
            answers.setdefault((name, state.slot), []).append(np.asarray(decision.action.heading_rad).tobytes())

    threads = [threading.Thread(target=ask, args=("ab"[k % 2],)) for k in range(24)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {len(given) for given in answers.values()} == {12}
    assert {len(set(given)) for given in answers.values()} == {1}


def test_velocities_at_the_slots_end_travel_and_are_checked(scenario, state):
    count = scenario.num_uavs
    action = JointAction(np.zeros(count), np.full(count, 9.0), np.full(count, 0.5), np.full(count, 4.0))
    document = decision_document("c", 0, "fixed", Decision(action), 1.0)
    back = decision_from(DecisionWire.model_validate_json(json.dumps(document))).action
    assert np.array_equal(back.end_vel_enu_mps, action.end_vel_enu_mps)
    assert fault_in(scenario, Decision(action)) is None
    for heading, speed in ((np.nan, 4.0), (0.5, 99.0), (0.5, -1.0)):
        wrong = JointAction(action.heading_rad, action.speed_mps, np.full(count, heading), np.full(count, speed))
        assert "at the slot's end" in fault_in(scenario, Decision(wrong))
