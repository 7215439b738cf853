"""Clocks against a small real server."""

import json
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from gcs.clock import ClockError, LockstepClock, RealClock


@contextmanager
def simulator(answer: Callable[[float], bytes]) -> Iterator[tuple[str, int]]:
    server = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        connection, _ = server.accept()
        with connection, connection.makefile("rb") as lines:
            for line in lines:
                reply = answer(json.loads(line)["advance_to_s"])
                if not reply:
                    return
                connection.sendall(reply)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield server.getsockname()[:2]
    finally:
        thread.join(5.0)
        server.close()


def echo(time_s: float) -> bytes:
    return b'{"now_s": %.6f}\n' % time_s


def test_time_is_the_simulators() -> None:
    with simulator(echo) as address:
        clock = LockstepClock(address)
        assert clock.is_virtual
        clock.wait_until(0.1)
        clock.wait_until(12.5)
        assert clock.now_s() == 12.5
        clock.wait_until(3.0)
        assert clock.now_s() == 12.5, "time does not run backwards"
        clock.close()


@pytest.mark.parametrize(
    ("reply", "words"), [(b"", "hung up"), (b"rubbish\n", "not a time"), (b'{"t": 1}\n', "not a time")]
)
def test_a_broken_simulator_is_one_line(reply: bytes, words: str) -> None:
    with simulator(lambda time_s: reply) as address:
        clock = LockstepClock(address)
        with pytest.raises(ClockError, match=words):
            clock.wait_until(1.0)
        clock.close()


def test_nobody_there() -> None:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        address = probe.getsockname()[:2]
    with pytest.raises(ClockError, match="is the mock running"):
        LockstepClock(address)


def test_real_time_is_scaled() -> None:
    clock = RealClock(1000.0)
    clock.wait_until(5.0)
    assert clock.now_s() >= 5.0
    assert not clock.is_virtual
    with pytest.raises(ValueError, match="positive"):
        RealClock(0.0)
