"""When clients of the stream are told."""

import asyncio

import pytest
from fake_control import FakeControl

from gcs.api import pace as pace_module
from gcs.api.pace import GRACE, Pace, next_turn_s


@pytest.fixture(autouse=True)
def quick_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock is the test's own; looks follow each other at once."""
    monkeypatch.setattr(pace_module, "LOOK_S", 0.0)


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


async def looked() -> None:
    """Several looks have been taken."""
    for _ in range(10):
        await asyncio.sleep(0)


def test_turns_are_multiples_of_the_period_and_never_now() -> None:
    assert next_turn_s(100.0, 5.0) == pytest.approx(100.2)
    assert next_turn_s(100.21, 5.0) == pytest.approx(100.4)
    assert next_turn_s(100.0, 0.1) == pytest.approx(110.0)


def test_clients_of_a_rate_are_told_the_same_new_tick_whenever_they_came() -> None:
    async def clients() -> None:
        control, clock = FakeControl(), Clock()
        pace = Pace(control, clock)
        turns = [asyncio.create_task(pace.turn(5.0, asyncio.Event())) for _ in range(2)]
        await looked()
        clock.now_s = 100.1
        turns.append(asyncio.create_task(pace.turn(5.0, asyncio.Event())))
        control.tick()
        await looked()
        assert not any(turn.done() for turn in turns), "told before its turn"
        clock.now_s = 100.21
        await looked()
        assert not any(turn.done() for turn in turns), "told an old tick although the flight goes on"
        control.tick()
        await looked()
        assert all(turn.done() for turn in turns)

    asyncio.run(clients())


def test_a_flight_that_stands_still_is_told_of() -> None:
    async def client() -> None:
        control, clock = FakeControl(), Clock()
        turn = asyncio.create_task(Pace(control, clock).turn(5.0, asyncio.Event()))
        await looked()
        clock.now_s = 100.2 + 0.9 * GRACE / 5.0
        await looked()
        assert not turn.done()
        clock.now_s = 100.2 + 1.01 * GRACE / 5.0
        await looked()
        assert turn.done()

    asyncio.run(client())


def test_who_changes_its_mind_is_woken_at_once_and_nobody_looks_when_nobody_waits() -> None:
    async def client() -> None:
        pace, wake = Pace(FakeControl(), Clock()), asyncio.Event()
        turn = asyncio.create_task(pace.turn(0.1, wake))
        await looked()
        wake.set()
        await turn
        await looked()
        assert len(asyncio.all_tasks()) == 1, "only this one"
        again = asyncio.create_task(pace.turn(0.1, asyncio.Event()))
        await looked()
        again.cancel()  # its client has gone
        await asyncio.gather(again, return_exceptions=True)
        await looked()
        assert len(asyncio.all_tasks()) == 1

    asyncio.run(client())
