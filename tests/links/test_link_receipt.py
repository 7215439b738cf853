"""When a message counts as received: after it has been read, however long the reading took."""

from collections.abc import Sequence
from types import SimpleNamespace

import pytest

from gcs.links.fleet_link import WiredFleetLink
from gcs.links.wire import Fields, Heard, Path

PATH = Path("udpin:test", ("127.0.0.1", 1))


class SlowWire:
    """Vehicle 1 was booted at our time 0 and its place leaves when it is read, ``read_s`` after the poll began."""

    def __init__(self) -> None:
        self.now_s, self.read_s = 0.0, 0.0

    def read(self, now_s: float) -> Sequence[Heard]:
        self.now_s = now_s + self.read_s
        beat = SimpleNamespace(autopilot=12, type=2, base_mode=128, custom_mode=6 << 16)
        place = SimpleNamespace(
            time_boot_ms=round(1e3 * self.now_s), lat=1, lon=1, alt=0, relative_alt=0, vx=0, vy=0, vz=0
        )
        return [Heard(PATH, "HEARTBEAT", 1, 1, None, beat), Heard(PATH, "GLOBAL_POSITION_INT", 1, 1, None, place)]

    def write(self, name: str, fields: Fields, paths: Sequence[Path], now_s: float) -> None: ...

    def troubles(self) -> list[str]:
        return []

    def skipped(self) -> dict[str, int]:
        return {}

    def close(self) -> None: ...


@pytest.mark.parametrize(("has_clock", "age_s"), [(True, 0.0), (False, 2.0)])
def test_a_slow_poll_does_not_make_every_later_place_old(has_clock: bool, age_s: float) -> None:
    """Without a clock the least delay ever seen would be the negative one of the slow poll, for hours."""
    wire = SlowWire()
    link = WiredFleetLink(wire, clock=(lambda: wire.now_s) if has_clock else None)
    for tick in range(100):
        wire.read_s = 2.0 if tick == 20 else 0.0
        link.poll(3.0 * tick)
    position_s = link.vehicles()[1].position_s
    assert position_s is not None
    assert wire.now_s - position_s == pytest.approx(age_s, abs=0.05)
