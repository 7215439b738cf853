"""Whatever a policy tells, the page gets names, numbers and nothing else."""

from typing import Any

import httpx
import pytest
from api_server import Server
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcs.api.explanations import explanation_view
from gcs.ports import CampaignSnapshot, CampaignState, SlotRecord, UavSlot, UserSlot

UAVS = tuple(UavSlot(system_id, 0.0, 0.0, 0.0, 0.0, 0.0) for system_id in (4, 7))
USERS = tuple(UserSlot(name, 1.0, 2.0, 1.0, 0.0, False) for name in ("ann", "bob"))


def campaign(explanation: dict[str, Any]) -> CampaignSnapshot:
    latest = SlotRecord(3, 45.0, UAVS, USERS, None)
    return CampaignSnapshot(
        "c1", "n", "gcrl", CampaignState.FLYING, 3, 9, 15.0, 0.0, latest=latest, explanation=explanation
    )


def test_indices_become_system_ids_and_names():
    move = {"heading_deg": 45.0, "speed_mps": 18.0, "value": 12.5, "worse_by": 0.5}
    told = {
        "value": 12.0,
        "predicted_gain": None,
        "horizon_slots": 8,
        "uavs": [{"uav": 1, "path_enu_m": [[0, 0], [10, 5]], "alternatives": [move]}],
        "relations": [[], [{"user": 1, "weight": 0.4}, {"user": 0, "weight": 0.1}]],
    }
    view = explanation_view(campaign(told))
    assert (view.slot, view.value, view.predicted_gain, view.horizon_slots) == (3, 12.0, None, 8)
    assert [uav.system_id for uav in view.uavs] == [4, 7]
    assert view.uavs[1].path_m == [(0.0, 0.0), (10.0, 5.0)]
    assert view.uavs[1].alternatives[0].model_dump() == move
    assert [(r.user_id, r.weight) for r in view.uavs[1].relations] == [("bob", 0.4), ("ann", 0.1)]


@pytest.mark.parametrize(
    "told",
    [
        {},
        {"uavs": "none", "relations": 7, "value": "dear", "horizon_slots": True},
        {"uavs": [{"uav": 0, "path_enu_m": [[1], [2, 3]], "alternatives": [{"heading_deg": 1.0}]}]},
        {
            "relations": [
                [{"user": 99, "weight": 0.5}, {"user": -1, "weight": 0.5}, {"user": 0, "weight": float("nan")}]
            ]
        },
        {"uavs": [{"uav": [1]}, {"uav": 0, "path_enu_m": [[float("inf"), 0.0]]}]},
    ],
)
def test_what_does_not_fit_is_left_out(told: dict[str, Any]):
    view = explanation_view(campaign(told))
    assert view.value is None
    assert all(not uav.path_m and not uav.alternatives and not uav.relations for uav in view.uavs)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["uav", "user", "weight"]), inner),
    max_leaves=10,
)


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow], deadline=None)  # the machine may be loaded
@given(st.dictionaries(st.sampled_from(["uavs", "relations", "value", "horizon_slots", "predicted_gain"]), JSON))
def test_no_explanation_can_break_the_page(told: dict[str, Any]):
    explanation_view(campaign(told)).model_dump_json()


def test_only_the_campaign_in_the_air_is_explained(keyed: Server, operator: httpx.Client, campaign_id: str) -> None:
    url = f"/api/v1/campaigns/{campaign_id}/explanation"
    assert operator.get(url).status_code == 404
    operator.post(f"/api/v1/campaigns/{campaign_id}/start")
    keyed.control.end_slot(1)
    assert operator.get(url).json()["policy"] == "random"
    assert operator.get("/api/v1/campaigns/none/explanation").status_code == 404
