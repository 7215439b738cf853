"""What a campaign's gate is told of it."""

from dataclasses import replace

import pytest

from gcs.ports import UavTrack, VelocitySetpoint
from gcs.safety.envelope import envelope_of
from gcs.safety.gate import SafetyGate, Wish
from policy.mission_file import load_mission

SCENARIO = load_mission("demo").scenario


@pytest.mark.parametrize(
    ("layer_m", "apart_m"), [(10.0, 4.0), (5.0, 4.0), (4.0, 3.2), (1.0, 0.8), (0.5, 4.0), (0.0, 4.0)]
)
def test_layers_count_as_separation_where_they_are_layers(layer_m: float, apart_m: float) -> None:
    assert envelope_of(replace(SCENARIO, layer_m=layer_m), 4.5).vertical_separation_m == pytest.approx(apart_m)


def test_without_layers_two_at_about_one_height_keep_apart() -> None:
    """layer_m = 0 once counted heights 0.3 m apart as layers: nothing kept the two from meeting."""
    gate = SafetyGate(envelope_of(replace(SCENARIO, layer_m=0.0), 4.5))
    east_m, north_m = (0.5 * size_m for size_m in SCENARIO.area.size_m)
    alt_m = SCENARIO.altitude_m
    first = UavTrack(1, east_m, north_m, alt_m, 0.0, 0.0, 0.0, 0.0, 0.0)
    second = UavTrack(2, east_m + 14.0, north_m, alt_m + 0.3, 0.0, 0.0, 0.0, 0.0, 0.0)
    toward = VelocitySetpoint(1, (0.0, 10.0, 0.0), 0.0), VelocitySetpoint(2, (0.0, -10.0, 0.0), 0.0)
    safe = gate.judge([Wish(toward[0], first), Wish(toward[1], second)])
    assert "separation" in {setpoint.reason for setpoint in safe}
