"""The flight thread keeps the interpreter while it works."""

import sys
import threading
import time
from collections.abc import Iterator

import pytest

from gcs.clock import RealClock
from gcs.right_of_way import WAITING_S, WORKING_S, RightOfWay


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


def test_a_tick_s_work_is_not_taken_apart_by_busy_threads() -> None:
    """Three threads that only compute: shared evenly, 10 ms of work would take 40."""
    stop, clock = threading.Event(), RealClock()
    flight = RightOfWay(clock)

    def compute() -> None:
        while not stop.is_set():
            pass

    busy = [threading.Thread(target=compute, daemon=True) for _ in range(3)]
    for thread in busy:
        thread.start()
    lost_s = []
    try:
        for _ in range(20):
            flight.wait_until(clock.now_s() + 0.005)
            begun_s, begun_cpu_s = time.perf_counter(), time.thread_time()
            while time.thread_time() - begun_cpu_s < 0.01:
                pass
            lost_s.append(time.perf_counter() - begun_s - 0.01)
    finally:
        stop.set()
        for thread in busy:
            thread.join()
    assert sorted(lost_s)[len(lost_s) // 2] < 0.01
