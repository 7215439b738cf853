"""Why a decision was made, as it is kept: bounded, without what does not fit, and never in the decision's way."""

import json
import math
from typing import Any

import pytest

from gcs.ports import DecisionRecord
from gcs.store.decision_documents import decision_document, recorded_decision, without_places
from gcs.store.reasons import FAILED, WIPED, kept_reasons
from policy.agents.base import Explanation

MOVE = {"heading_deg": 45.0, "speed_mps": 18.0, "value": 12.5, "worse_by": 0.5}
TOLD = {
    "horizon_slots": 8,
    "value": 12.0,
    "predicted_gain": None,
    "uavs": [{"uav": 1, "path_enu_m": [[0, 0], [10, 5.04]], "alternatives": [MOVE]}],
    "relations": [[], [{"user": 1, "weight": 0.41}, {"user": 5, "weight": 0.1}]],
    "predicted_user_enu_m": [[1.0, 2.0], [3.0, 4.0]],
}
FAR_M = [-12345.678, -12345.678]
RECORD = DecisionRecord(
    0, ((1.0, 2.0),), ((0.0, 0.0),), (9.0,), (True,), (0.1 + 0.2,), (7.0,), 1.0, users=((437.2, 2.0, 0.25, 3.0, True),),
    time_s=12.5, max_accel_mps2=math.inf, explanation=TOLD,
)  # fmt: skip


def test_what_is_told_is_kept_in_the_reach_of_a_reader() -> None:
    kept = kept_reasons(TOLD)
    assert (kept["horizon_slots"], kept["value"], kept["predicted_gain"]) == (8, 12.0, None)
    (uav,) = kept["uavs"]
    assert (uav["uav"], uav["path_m"], uav["alternatives"]) == (1, [(0.0, 0.0), (10.0, 5.0)], [MOVE])
    assert uav["relations"] == [
        {"user": 1, "weight": 0.41, "expected_m": (3.0, 4.0)},
        {"user": 5, "weight": 0.1, "expected_m": None},
    ]


def test_it_is_bounded_whatever_is_told() -> None:
    uavs, many = 40, 5_000
    told: dict[str, Any] = {
        "uavs": [
            {"uav": u, "path_enu_m": [FAR_M] * many, "alternatives": [dict.fromkeys(MOVE, 123.45678)] * many}
            for u in range(uavs)
        ],
        "relations": [[{"user": many - i, "weight": 0.123456} for i in range(many)]] * uavs,
        "predicted_user_enu_m": [FAR_M] * (many + 1),
        "more": "x" * many,
    }  # fmt: skip
    assert len(json.dumps(kept_reasons(told))) < 2_000 * uavs


def test_a_policy_that_cannot_say_why_has_its_decision_kept() -> None:
    def broken() -> dict[str, Any]:
        raise RuntimeError("the network is gone")

    document = decision_document(RECORD.__class__(**{**vars(RECORD), "explanation": Explanation(broken)}))
    assert document["explanation"] == {FAILED: "RuntimeError: the network is gone"}
    assert document["heading_rad"] == [0.1 + 0.2]
    assert FAILED in kept_reasons(7)  # type: ignore[arg-type]


def test_a_decision_comes_back_from_its_document_with_every_bit() -> None:
    document = json.loads(json.dumps(decision_document(RECORD), allow_nan=False))
    back = recorded_decision(document)
    assert (back.heading_rad, back.users, back.time_s, back.max_accel_mps2) == (
        (0.1 + 0.2,),
        RECORD.users,
        12.5,
        math.inf,
    )
    assert back.explanation == json.loads(json.dumps(kept_reasons(TOLD)))


@pytest.mark.parametrize("missing", ["time_s", "explanation"])
def test_documents_of_older_versions_are_read(missing: str) -> None:
    document = {name: value for name, value in decision_document(RECORD).items() if name != missing}
    back = recorded_decision(document)
    assert math.isnan(back.time_s) if missing == "time_s" else back.explanation is None


def test_without_places_nobody_can_tell_whom_it_flew_for() -> None:
    bare = without_places(decision_document(RECORD))
    assert bare["users"] == [[None, None, 0.25, 3.0, True]]
    assert bare["explanation"]["uavs"][0]["relations"] == []
    assert bare["explanation"]["uavs"][0]["alternatives"] == [MOVE]
    assert bare["explanation"][WIPED] is True
    assert without_places(bare) == bare
    assert "explanation" not in without_places({"users": []})
    failed = {FAILED: "why"}
    assert without_places({"explanation": failed})["explanation"] == failed
