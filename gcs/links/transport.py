"""Ways to vehicles that never block: ``udpout:``, ``udpin:``, ``tcp:HOST:PORT`` and ``serial:DEVICE:BAUD``."""

import contextlib
import errno
import socket
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import serial

from gcs.links.datagrams import AT_ONCE, datagrams_of

RECEIVE_BUFFER_BYTES = 4 << 20  # one frame a datagram from many vehicles overruns the default
_MAX_DATAGRAM_BYTES = 65_535
_MOST_CHUNKS = 16  # of a stream in one turn: a megabyte
_RECONNECT_S = 1.0
KEPT_DATAGRAMS = 2_000
"""Of those that wait on all sockets together about so many are decoded in one turn (some 30 ms of work)."""
LEAST_KEPT = 50
"""Of one socket, however many there are."""
MOST_READS = 20_000
"""In one turn from one socket: a flood that comes faster than it is read shall not keep the flight waiting."""
_SCHEMES = frozenset({"udpout", "udpin", "tcp", "serial"})
_HOW = "write udpout:HOST:PORT, udpin:HOST:PORT, tcp:HOST:PORT or serial:DEVICE:BAUD"

Peer = tuple[str, int]


class LinkError(ValueError):
    """An address that cannot be used: what, why and how to mend it, in one line."""


class Transport(Protocol):
    """Bytes to and from peers; nothing here waits."""

    address: str
    skipped: int
    """Datagrams thrown away unread so far, since newer ones were waiting behind more than could be decoded."""

    def read(self, now_s: float) -> list[tuple[Peer, bytes]]: ...

    def write(self, data: bytes, peer: Peer | None) -> None:
        """Send to ``peer``, or to everyone known when None. A full buffer drops, as a radio would."""

    def peers(self) -> list[Peer]:
        """Everyone known."""

    def take_trouble(self) -> str:
        """Why something could not be sent or read since the last call; empty: nothing, or it is told otherwise."""

    def close(self) -> None: ...


@dataclass(frozen=True)
class Address:
    """A parsed ``scheme:host:port``; for a serial line the device and its baud rate."""

    scheme: str
    host: str
    port: int


def parse_address(text: str) -> Address:
    """Parse an address or raise LinkError."""
    parts = text.split(":")
    if len(parts) != 3 or parts[0] not in _SCHEMES or not parts[1]:
        raise LinkError(f"address '{text}' is not understood; {_HOW}")
    if parts[0] == "serial":
        if not parts[2].isdecimal() or not 1200 <= int(parts[2]) <= 4_000_000:
            raise LinkError(f"address '{text}' has no baud rate; write for example serial:{parts[1]}:57600")
    elif not parts[2].isdecimal() or not 1 <= int(parts[2]) <= 65_535:
        raise LinkError(
            f"address '{text}' has no port between 1 and 65535; write for example {parts[0]}:{parts[1]}:14550"
        )
    return Address(parts[0], parts[1], int(parts[2]))


def open_transport(text: str, kept_datagrams: int = KEPT_DATAGRAMS) -> Transport:
    """Open the transport that an address names; LinkError when the port is taken or the host unknown.

    ``kept_datagrams``: of those that wait on a UDP socket the newest so many are read at a time.
    """
    address = parse_address(text)
    if address.scheme == "serial":
        return SerialTransport(text, address.host, address.port)
    try:
        host = socket.gethostbyname(address.host)
    except OSError as error:
        raise LinkError(f"address '{text}': host '{address.host}' is not known ({error.strerror or error})") from error
    if address.scheme == "tcp":
        return TcpTransport(text, (host, address.port))
    return UdpTransport(text, (host, address.port), listening=address.scheme == "udpin", kept=kept_datagrams)


def open_all(addresses: Sequence[str]) -> list[Transport]:
    """Open each; when one cannot be opened, none stays open."""
    opened: list[Transport] = []
    kept = max(LEAST_KEPT, KEPT_DATAGRAMS // max(len(addresses), 1))
    try:
        opened.extend(open_transport(address, kept) for address in addresses)
    except LinkError:
        for transport in opened:
            transport.close()
        raise
    return opened


def troubles_of(transports: Iterable[Transport]) -> list[str]:
    """A sentence for each on which something could not be sent or read since the last call."""
    return [
        f"{transport.address}: not everything could be sent or read ({words}); is this machine's network up?"
        for transport in transports
        if (words := transport.take_trouble())
    ]


class UdpTransport:
    """One UDP socket. Outgoing: one fixed peer. Listening: peers are whoever has spoken."""

    def __init__(self, address: str, where: Peer, *, listening: bool, kept: int = KEPT_DATAGRAMS) -> None:
        self.address, self.skipped = address, 0
        self._kept, self._trouble = kept, ""
        self._peers: dict[Peer, None] = {} if listening else {where: None}
        self._learns = listening
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        self._datagrams = datagrams_of(self._socket)
        if listening:
            self._bind(where)

    def _bind(self, where: Peer) -> None:
        try:
            self._socket.bind(where)
        except OSError as error:
            self._socket.close()
            hint = "stop the program that holds it or choose another port"
            raise LinkError(f"cannot listen on '{self.address}': {error.strerror}; {hint}") from error

    def read(self, now_s: float) -> list[tuple[Peer, bytes]]:
        """What is waiting; of more than can be decoded the newest, so that no old place passes for a new one."""
        received: deque[tuple[Peer, bytes]] = deque(maxlen=self._kept)
        count = 0
        for _ in range(MOST_READS // AT_ONCE):
            try:
                batch = self._datagrams.receive()
            except ConnectionRefusedError:  # an ICMP answer to an earlier datagram: nobody listens there yet
                continue
            except OSError as error:  # this network is gone; the drones on others fly on
                self._trouble = error.strerror or str(error)
                break
            for data, peer in batch:
                if self._learns:
                    self._peers[peer] = None
                received.append((peer, data))
            count += len(batch)
            if len(batch) < AT_ONCE:
                break
        self.skipped += count - len(received)
        return list(received)

    def peers(self) -> list[Peer]:
        """Where we call, or who has called."""
        return list(self._peers)

    def write(self, data: bytes, peer: Peer | None) -> None:
        """Send one datagram; what cannot leave is lost, as on a radio, whatever the reason (no route, no network)."""
        for target in [peer] if peer is not None else list(self._peers):
            try:
                self._datagrams.send(data, target)
            except (BlockingIOError, ConnectionRefusedError):
                continue
            except OSError as error:
                self._trouble = error.strerror or str(error)

    def take_trouble(self) -> str:
        """Why a datagram could not be sent or read since the last call."""
        trouble, self._trouble = self._trouble, ""
        return trouble

    def close(self) -> None:
        """Release the port."""
        self._socket.close()


class TcpTransport:
    """A TCP client that reconnects once a second after a loss."""

    def __init__(self, address: str, where: Peer) -> None:
        self.address, self.skipped = address, 0
        self._where = where
        self._socket: socket.socket | None = None
        self._retry_s = float("-inf")

    def read(self, now_s: float) -> list[tuple[Peer, bytes]]:
        """What has arrived; begins a new connection when there is none."""
        if self._socket is None:
            self._begin(now_s)
        received: list[tuple[Peer, bytes]] = []
        while self._socket is not None and len(received) < _MOST_CHUNKS:
            try:
                data = self._socket.recv(_MAX_DATAGRAM_BYTES)
            except BlockingIOError:
                return received
            except OSError as error:
                if error.errno != errno.ENOTCONN:
                    self._drop(now_s)
                return received
            if not data:
                self._drop(now_s)
                return received
            received.append((self._where, data))
        return received

    def peers(self) -> list[Peer]:
        """The other end."""
        return [self._where]

    def take_trouble(self) -> str:
        """Nothing: a broken connection is opened again, and its silence is told."""
        return ""

    def write(self, data: bytes, peer: Peer | None) -> None:
        """Send; a broken or unfinished connection drops the bytes and is noticed by read."""
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.send(data)

    def close(self) -> None:
        """End the connection."""
        if self._socket is not None:
            self._socket.close()

    def _begin(self, now_s: float) -> None:
        if now_s < self._retry_s:
            return
        self._retry_s = now_s + _RECONNECT_S
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.connect_ex(self._where)

    def _drop(self, now_s: float) -> None:
        if self._socket is not None:
            self._socket.close()
        self._socket = None
        self._retry_s = now_s + _RECONNECT_S


class SerialTransport:
    """A serial line, such as a telemetry radio on USB; opened again once a second after it was pulled out."""

    def __init__(self, address: str, device: str, baud: int) -> None:
        self.address, self.skipped = address, 0
        self._device, self._baud = device, baud
        self._peer: Peer = (device, 0)
        self._retry_s = float("-inf")
        self._line: serial.Serial | None = self._open()

    def read(self, now_s: float) -> list[tuple[Peer, bytes]]:
        """What has arrived."""
        if self._line is None:
            self._begin(now_s)
        if self._line is None:
            return []
        try:
            data = self._line.read(_MAX_DATAGRAM_BYTES)
        except (OSError, TypeError):  # SerialException is an OSError; pyserial's TypeError: closed meanwhile
            self._drop(now_s)
            return []
        return [(self._peer, data)] if data else []

    def peers(self) -> list[Peer]:
        """The other end."""
        return [self._peer]

    def take_trouble(self) -> str:
        """Nothing: a broken connection is opened again, and its silence is told."""
        return ""

    def write(self, data: bytes, peer: Peer | None) -> None:
        """Send; what the line does not take at once is dropped, as a radio would."""
        if self._line is not None:
            with contextlib.suppress(OSError):
                self._line.write(data)

    def close(self) -> None:
        """Give the device back."""
        if self._line is not None:
            self._line.close()
        self._line = None

    def _open(self) -> serial.Serial:
        try:
            return serial.Serial(self._device, self._baud, timeout=0, write_timeout=0, exclusive=True)
        except (OSError, ValueError) as error:
            hint = "plug it in, stop the program that holds it, or join the group that may open it (dialout)"
            raise LinkError(f"cannot open '{self.address}': {error}; {hint}") from error

    def _begin(self, now_s: float) -> None:
        if now_s < self._retry_s:
            return
        self._retry_s = now_s + _RECONNECT_S
        with contextlib.suppress(LinkError):
            self._line = self._open()

    def _drop(self, now_s: float) -> None:
        self.close()
        self._retry_s = now_s + _RECONNECT_S
