"""A campaign flown with a chosen model, and what a vehicle's way home takes."""

from dataclasses import replace

import httpx
import pytest
from fake_control import vehicle

from gcs.api.views import return_fraction
from gcs.mission.watch import return_energy_j
from policy.mission_file import load_mission

MODEL = "gcrl-default.safetensors"


def test_a_model_that_ships_is_chosen_by_its_bare_name(operator: httpx.Client) -> None:
    wish = {"mission": "demo", "policy": "gcrl", "checkpoint": MODEL}
    answer = operator.post("/api/v1/campaigns", json=wish)
    assert answer.status_code == 201, answer.text
    assert answer.json()["document"]["policy"] == {"name": "gcrl", "checkpoint": MODEL}
    (shelf,) = [one for one in operator.get("/api/v1/policies").json() if one["name"] == "gcrl"]
    assert MODEL in [one["file"] for one in shelf["checkpoints"]]


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ({"policy": "gcrl", "checkpoint": "none.safetensors"}, "no file"),
        ({"policy": "gcrl", "checkpoint": f"../checkpoints/{MODEL}"}, "checkpoint"),
        ({"policy": "random", "checkpoint": MODEL}, "does not learn"),
    ],
)
def test_a_model_that_cannot_fly_is_refused_at_once(operator: httpx.Client, wish: dict[str, str], words: str) -> None:
    answer = operator.post("/api/v1/campaigns", json={"mission": "demo"} | wish)
    assert answer.status_code == 422
    assert words in answer.text


def test_another_policy_does_not_take_the_missions_model_along(operator: httpx.Client) -> None:
    answer = operator.post("/api/v1/campaigns", json={"mission": "demo", "policy": "random"})
    assert answer.json()["document"]["policy"] == {"name": "random"}


def test_the_way_home_is_counted_as_the_mission_manager_counts_it():
    scenario = load_mission("demo").scenario
    frame = scenario.area.frame
    lat_deg, lon_deg = (float(x) for x in frame.to_geodetic_deg(900.0, 400.0))
    home_lat, home_lon = (float(x) for x in frame.to_geodetic_deg(600.0, 0.0))
    status = replace(vehicle(1), lat_deg=lat_deg, lon_deg=lon_deg, home_lat_deg=home_lat, home_lon_deg=home_lon)
    expected = return_energy_j(500.0, 120.0) / scenario.battery_j
    assert return_fraction(status, frame, scenario.battery_j) == pytest.approx(expected, rel=1e-6)
    assert return_fraction(replace(status, home_lat_deg=None), frame, scenario.battery_j) is None
