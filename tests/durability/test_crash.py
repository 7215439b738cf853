"""kill -9 of a real server in the middle of a flight over real sockets; `make crash` does it fifty times."""

import random
from pathlib import Path

import pytest
from crash import crash

SLOTS = 6


@pytest.mark.flight
def test_a_killed_server_takes_its_campaign_up_again(tmp_path: Path) -> None:
    draw = random.Random()
    flavour = draw.choice(["px4", "ardupilot"])
    moments = [draw.uniform(0.5, 6.0) for _ in range(2)]
    log = crash(f"sqlite:///{tmp_path / 'crash.db'}", moments, speedup=6.0, slots=SLOTS, flavour=flavour)
    told = f"killed after {moments} s while {log.killed_in}, {flavour}: {log}"
    assert (log.state, log.reason, log.still_armed) == ("done", "", []), told
    assert log.slots == list(range(SLOTS + 1)), told
    assert log.whole, told
    assert sum(log.told) > 0, told
    assert log.given("takeoff") == {1, 2}, told
    assert not log.twice, f"nobody takes off twice; {told}"
    assert all(seconds < 5.0 for seconds in log.resumed_s), told
