"""What one vehicle says cannot end the flight of all, however wrong it is."""

import math
from types import SimpleNamespace

import pytest

from gcs.links.fleet_link import WiredFleetLink
from gcs.links.mavsdk_link import _body
from gcs.links.wire import Fields, Heard, Path

PATH = Path("udpin:0.0.0.0:1", ("127.0.0.1", 1))
BEAT = SimpleNamespace(autopilot=12, type=2, base_mode=128, custom_mode=6 << 16)


class Wire:
    """Two vehicles; the first says something that is none between the second one's messages."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def read(self, now_s: float) -> list[Heard]:
        place = SimpleNamespace(
            time_boot_ms=round(1e3 * now_s), lat=1, lon=1, alt=0, relative_alt=round(1e3 * now_s), vx=0, vy=0, vz=0
        )
        nonsense = SimpleNamespace(flags=math.nan)  # as MAVSDK's JSON has it for a value that is no number
        return [
            Heard(PATH, "HEARTBEAT", 1, 1, None, BEAT),
            Heard(PATH, "HEARTBEAT", 2, 1, None, BEAT),
            Heard(PATH, "ESTIMATOR_STATUS", 1, 1, None, nonsense),
            Heard(PATH, "GLOBAL_POSITION_INT", 2, 1, None, place),
        ]

    def write(self, name: str, fields: Fields, paths: object, now_s: float) -> None: ...

    def troubles(self) -> list[str]:
        return []

    def skipped(self) -> dict[str, int]:
        return {}

    def close(self) -> None: ...


def test_a_message_that_cannot_be_taken_in_is_passed_over_and_told_once() -> None:
    link = WiredFleetLink(Wire())
    told: list[str] = []
    for tick in range(5):
        link.poll(1.0 + tick)
        told += link.drain_notices()
    assert link.vehicles()[2].alt_home_m == 5.0
    assert link.vehicles()[1].armed
    assert ["vehicle 1" in words and "ESTIMATOR_STATUS" in words for words in told] == [True]


@pytest.mark.parametrize("document", ["", "{", "nan", "NaN", "[]", '{"text": "\\ud800'])
def test_json_that_is_none_is_no_message(document: str) -> None:
    assert _body("STATUSTEXT", document) is None
