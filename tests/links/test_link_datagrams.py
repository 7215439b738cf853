"""Datagrams by libc and by the socket mean the same: what comes, from whom, and what goes wrong."""

import socket
import sys
import threading
import time
from collections.abc import Iterator

import pytest

from gcs.links.datagrams import AT_ONCE, Datagrams, HeldDatagrams, datagrams_of

KINDS = [Datagrams, *([HeldDatagrams] if sys.platform == "linux" else [])]


def bound() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setblocking(False)
    made.bind(("127.0.0.1", 0))
    return made


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    with bound() as one, bound() as other:
        yield one, other


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("data", [b"", b"\x00", b"\xfd" * 280, bytes(range(256)) * 200])
def test_what_is_sent_is_received_with_its_sender(
    kind: type[Datagrams], data: bytes, pair: tuple[socket.socket, socket.socket]
) -> None:
    one, other = kind(pair[0]), kind(pair[1])
    one.send(data, pair[1].getsockname())
    one.send(b"next", pair[1].getsockname())
    assert other.receive() == [(data, pair[0].getsockname()), (b"next", pair[0].getsockname())]
    assert other.receive() == []


@pytest.mark.parametrize("kind", KINDS)
def test_more_than_fit_at_once_come_in_their_order_from_whoever_sent_them(
    kind: type[Datagrams], pair: tuple[socket.socket, socket.socket]
) -> None:
    one, other, calls = *pair, kind(pair[1])
    sent = [(bytes([number]) * (1 + 40 * number), (one, other)[number % 2]) for number in range(2 * AT_ONCE + 3)]
    for data, who in sent:
        kind(who).send(data, other.getsockname())
    batches = [calls.receive() for _ in range(4)]
    assert [len(batch) for batch in batches] == [AT_ONCE, AT_ONCE, 3, 0]
    assert [one for batch in batches for one in batch] == [(data, who.getsockname()) for data, who in sent]


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_waiting_is_no_error(kind: type[Datagrams], pair: tuple[socket.socket, socket.socket]) -> None:
    assert kind(pair[0]).receive() == []


@pytest.mark.parametrize("kind", KINDS)
def test_a_datagram_that_is_too_large_or_a_closed_socket_is_an_error(kind: type[Datagrams]) -> None:
    with bound() as own:
        calls = kind(own)
        with pytest.raises(OSError, match="too long"):
            calls.send(bytes(70_000), own.getsockname())
        where = own.getsockname()
    with pytest.raises(OSError, match="Bad file descriptor"):
        calls.send(b"late", where)
    with pytest.raises(OSError, match="Bad file descriptor"):
        calls.receive()


@pytest.mark.parametrize("kind", KINDS)
def test_nobody_listening_is_told_once_and_the_socket_goes_on(
    kind: type[Datagrams], pair: tuple[socket.socket, socket.socket]
) -> None:
    """The kernel's word about an earlier datagram; on loopback it is there at once."""
    own = pair[0]
    gone = pair[1].getsockname()
    pair[1].close()
    own.connect(gone)  # only a connected socket is told
    calls = kind(own)
    calls.send(b"anybody?", gone)
    with pytest.raises(ConnectionRefusedError):
        calls.receive()
    assert calls.receive() == []


def test_linux_gets_the_calls_that_keep_hold_of_the_interpreter(pair: tuple[socket.socket, socket.socket]) -> None:
    assert isinstance(datagrams_of(pair[0]), HeldDatagrams) == (sys.platform == "linux")


@pytest.mark.parametrize("kind", KINDS[1:])  # the socket's own methods let go
def test_nobody_takes_the_interpreter_from_who_reads_and_sends(
    kind: type[Datagrams], pair: tuple[socket.socket, socket.socket]
) -> None:
    """A thread that waits for the interpreter gets it where a call lets go of it, and keeps it for the interval."""
    here, there, interval_s = kind(pair[0]), pair[0].getsockname(), sys.getswitchinterval()
    stop, computed = threading.Event(), [0]

    def compute() -> None:
        while not stop.is_set():
            computed[0] += 1

    busy = threading.Thread(target=compute)
    busy.start()
    try:
        sys.setswitchinterval(1.0)
        time.sleep(0.001)  # from here on this thread has the interpreter
        before = computed[0]
        for _ in range(1_500):
            here.send(b"x", there)
            here.receive(), here.receive()
        meanwhile = computed[0] - before
    finally:
        sys.setswitchinterval(interval_s)
        stop.set()
        busy.join()
    assert meanwhile == 0
