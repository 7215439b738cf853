"""Relation weights of one slot are those that the agent itself tells there."""

import json
from dataclasses import replace

import numpy as np
import pytest

from policy.agents.gcrl import GcrlAgent
from policy.evaluation.tables import network_plots
from policy.evaluation.tables.campuses import find_campus
from policy.evaluation.tables.grid import SECTIONS, Extent, make_grid
from policy.evaluation.tables.methods import find_models
from policy.evaluation.tables.relations import make_relations, weigh_relations
from policy.mobility.feed import TraceFeed
from policy.world.state import initial_state
from policy.world.transition import step


@pytest.fixture
def campus(tiny):
    return find_campus(str(tiny), None)


@pytest.fixture
def method():
    return make_grid(SECTIONS, ["tiny"], Extent(1), find_models(None)).attending


def test_the_weights_are_the_agent_s_own_of_that_slot(campus, method):
    task = make_relations(campus, method)
    told = json.loads(json.dumps(weigh_relations(task)))
    weights = np.asarray(told["weights"])
    assert weights.shape == (2, 9)
    assert told["slot"] == 6

    agent, places = GcrlAgent.load(), TraceFeed(task.traces).as_places()
    agent.reset(task.scenario, 0)
    state = initial_state(task.scenario, places.positions(0))
    for slot in range(7):
        decision = agent.decide(state)
        if slot == 6:
            break
        state, _ = step(task.scenario, state, decision.action, places.positions(slot + 1))
    for row, greatest in zip(weights, decision.explanation["relations"], strict=True):
        assert [row[one["user"]] for one in greatest] == pytest.approx([one["weight"] for one in greatest], abs=1e-4)
        assert sorted(row)[-5:] == pytest.approx(sorted(one["weight"] for one in greatest), abs=1e-4)
    assert np.asarray(told["uav_pos_m"]) == pytest.approx(state.uav_pos_enu_m, abs=0.06)
    assert np.asarray(told["user_pos_m"]) == pytest.approx(state.user_pos_enu_m, abs=0.06)


def test_the_key_tells_networks_and_users_apart(campus, method, tiny):
    keys = {make_relations(campus, method).key, make_relations(campus, method.for_seed(0)).key}
    assert len(keys) == 1
    square = next(model for model in find_models(None) if model.similarity == "square")
    other = make_grid(SECTIONS, ["tiny"], Extent(1), [replace(square, similarity="gaussian")])
    keys.add(make_relations(campus, other.attending).key)
    keys.add(make_relations(find_campus(str(tiny), 8), method).key)
    assert len(keys) == 3


def test_lines_are_as_thick_as_their_weights(campus):
    told = {
        "slot": 6,
        "network": "gaussian",
        "uav_pos_m": [[100.0, 100.0], [900.0, 700.0]],
        "user_pos_m": [[200.0, 100.0], [500.0, 500.0]],
        "user_aoi_slots": [1.0, 4.0],
        "weights": [[0.4, 0.1], [0.0, 0.2]],
    }
    panel = network_plots.relation_lines(campus, told).axes[0]
    lines = [line for line in panel.lines if len(line.get_xdata()) == 2]
    widths = [line.get_linewidth() for line in lines]
    assert widths == pytest.approx([network_plots.WIDEST * share for share in (1.0, 0.25, 0.0, 0.5)])
    assert [list(line.get_ydata()) for line in lines] == [[100, 100], [100, 500], [700, 100], [700, 500]]


def test_every_kept_curve_is_a_line_and_without_one_there_is_no_picture():
    models = find_models(None)
    panels = network_plots.learning_curves(models).axes
    assert panels[0].get_legend_handles_labels()[1] == [f"{model.name} ({model.kind})" for model in models]
    for model, line in zip(models, panels[1].lines, strict=True):
        assert list(line.get_ydata()) == [point.value_loss for point in model.curve]
    assert network_plots.learning_curves([replace(model, curve=None) for model in models]) is None
