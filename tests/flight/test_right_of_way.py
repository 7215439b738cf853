"""The flight thread keeps the interpreter while it works."""

import sys
import threading
import time
from collections.abc import Iterator

import pytest

from gcs.clock import RealClock
from gcs.right_of_way import WAITING_S, WORKING_S, RightOfWay, giving_way


@pytest.fixture(autouse=True)
def interval() -> Iterator[None]:
    before = sys.getswitchinterval()
    yield
    sys.setswitchinterval(before)


class Watched:
    """A clock that notes the interval while it waits, and can fail."""

    is_virtual = False

    def __init__(self) -> None:
        self.intervals: list[float] = []
        self.broken = False

    def now_s(self) -> float:
        return 7.0

    def wait_until(self, time_s: float) -> None:
        self.intervals.append(sys.getswitchinterval())
        if self.broken:
            raise RuntimeError("the clock is gone")


def test_others_have_the_interpreter_while_it_waits_and_the_flight_afterwards() -> None:
    clock = Watched()
    flight = RightOfWay(clock)
    assert (flight.now_s(), flight.is_virtual) == (7.0, False)
    flight.wait_until(8.0)
    assert clock.intervals == [pytest.approx(WAITING_S)]
    assert sys.getswitchinterval() == pytest.approx(WORKING_S)
    clock.broken = True
    with pytest.raises(RuntimeError):
        flight.wait_until(9.0)
    assert sys.getswitchinterval() == pytest.approx(WORKING_S)


def test_it_gives_way_while_it_waits_for_others_and_who_never_had_it_changes_nothing() -> None:
    before, seen = sys.getswitchinterval(), []

    def fly() -> None:
        RightOfWay(Watched()).wait_until(8.0)
        with giving_way():
            seen.append(sys.getswitchinterval())
        seen.append(sys.getswitchinterval())

    def serve() -> None:
        with giving_way():
            seen.append(sys.getswitchinterval())

    for work in (serve, fly, serve):
        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
    assert seen == [pytest.approx(each) for each in (before, WAITING_S, WORKING_S, WORKING_S)]


@pytest.mark.parametrize("has_it", [True, False])
def test_a_tick_s_work_is_not_taken_apart_by_busy_threads(has_it: bool) -> None:
    """What others compute while the flight works: nothing. Without right of way they take turns with it."""
    stop, clock, computed = threading.Event(), RealClock(), [0, 0, 0]
    flight = RightOfWay(clock) if has_it else clock
    sys.setswitchinterval(WAITING_S)

    def compute(index: int) -> None:
        while not stop.is_set():
            computed[index] += 1

    busy = [threading.Thread(target=compute, args=(index,), daemon=True) for index in range(3)]
    for thread in busy:
        thread.start()
    meanwhile = []
    try:
        for _ in range(15):
            flight.wait_until(clock.now_s() + 0.002)
            before, begun_s = sum(computed), time.thread_time()
            while time.thread_time() - begun_s < 0.002:
                pass
            meanwhile.append(sum(computed) - before)
    finally:
        stop.set()
        for thread in busy:
            thread.join()
    assert (meanwhile.count(0) > 5) is has_it  # not all: a busy machine can stop the working thread as well
