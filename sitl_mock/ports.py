"""Ways to a vehicle: a UDP port that answers whoever sends to it, a TCP port like ArduPilot's 5760, a serial line."""

from __future__ import annotations

import os
import pty
import socket
import tty
from dataclasses import dataclass
from typing import Protocol

Address = tuple[str, int]
MAX_PEERS = 8  # ground stations remembered a vehicle; the one that was silent longest is forgotten
_BUFFER_BYTES = 4 << 20  # bursts of a whole fleet's setpoints fit
_DATAGRAM_BYTES = 65_535


class PortTakenError(OSError):
    """A port is in use; the message says which and how to choose another."""


@dataclass(frozen=True, slots=True)
class Received:
    """Bytes from a peer; `forgotten` is the peer whose place it took."""

    peer: int
    data: bytes
    forgotten: int | None = None


class Port(Protocol):
    """One way to a vehicle. It never blocks: what does not fit is lost, as on a radio."""

    def fileno(self) -> int:
        """What to wait on."""

    def drain(self) -> list[Received]:
        """Everything that has arrived."""

    def send(self, peer: int | None, data: bytes) -> None:
        """To one peer, or to all."""

    def close(self) -> None:
        """Gives it back."""


class UdpPort:
    """One vehicle's UDP socket."""

    def __init__(self, host: str, port: int, target: Address | None) -> None:
        """Binds host:port. `target` is pushed telemetry from the start."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise PortTakenError(
                f"UDP {host}:{port} cannot be bound ({error.strerror}): free it or change --first-port"
            ) from error
        self.address: Address = self._socket.getsockname()
        self._peers: dict[Address, int] = {}  # oldest first
        self._by_number: dict[int, Address] = {}
        self._pinned = target
        self._count = 0
        self.dropped = 0
        if target is not None:
            self._number(target)

    def fileno(self) -> int:
        """The socket."""
        return self._socket.fileno()

    def _number(self, address: Address) -> tuple[int, int | None]:
        """The peer's number, and that of the peer that was forgotten for it."""
        known = self._peers.pop(address, None)
        if known is not None:
            self._peers[address] = known
            return known, None
        forgotten = None
        if len(self._peers) >= MAX_PEERS:
            oldest = next(peer for peer in self._peers if peer != self._pinned)
            forgotten = self._peers.pop(oldest)
            del self._by_number[forgotten]
        self._count += 1
        self._peers[address] = self._count
        self._by_number[self._count] = address
        return self._count, forgotten

    def drain(self) -> list[Received]:
        """Everything that has arrived."""
        received: list[Received] = []
        while True:
            try:
                data, address = self._socket.recvfrom(_DATAGRAM_BYTES)
            except BlockingIOError:
                return received
            except ConnectionError:  # an earlier datagram met a closed port (ICMP); this one is lost
                continue
            peer, forgotten = self._number(address)
            received.append(Received(peer, data, forgotten))

    def send(self, peer: int | None, data: bytes) -> None:
        """To one peer, or to all."""
        if peer is None:
            addresses = list(self._peers)
        else:
            address = self._by_number.get(peer)
            addresses = [address] if address else []
        for address in addresses:
            try:
                self._socket.sendto(data, address)
            except OSError:  # buffer full, or a host that cannot be reached: the datagram is lost
                self.dropped += 1

    def close(self) -> None:
        """Gives the port back."""
        self._socket.close()


class TcpPort:
    """One vehicle's TCP server; each connection is a peer."""

    def __init__(self, host: str, port: int) -> None:
        """Listens on host:port."""
        self._listener = listen(host, port, "--tcp-first-port")
        self._listener.setblocking(False)
        self.address: Address = self._listener.getsockname()
        self._clients: dict[int, socket.socket] = {}
        self._count = 0
        self.dropped = 0

    def fileno(self) -> int:
        """The listener: a client's bytes are looked for every tick anyway."""
        return self._listener.fileno()

    def _accept(self) -> int | None:
        """Takes the callers; the oldest is hung up on when there are too many. Returns who was forgotten."""
        try:
            client, _ = self._listener.accept()
        except BlockingIOError:
            return None
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._count += 1
        self._clients[self._count] = client
        if len(self._clients) <= MAX_PEERS:
            return None
        oldest = next(iter(self._clients))
        self._hang_up(oldest)
        return oldest

    def _hang_up(self, peer: int) -> None:
        self._clients.pop(peer).close()

    def drain(self) -> list[Received]:
        """Everything that has arrived. Who hangs up is forgotten."""
        forgotten = self._accept()
        received: list[Received] = []
        for peer, client in list(self._clients.items()):
            try:
                data = client.recv(_DATAGRAM_BYTES)
            except BlockingIOError:
                continue
            except ConnectionError:
                data = b""
            if not data:
                self._hang_up(peer)
                received.append(Received(peer, b"", peer))
                continue
            received.append(Received(peer, data, forgotten))
        return received

    def send(self, peer: int | None, data: bytes) -> None:
        """To one peer, or to all."""
        for number, client in list(self._clients.items()):
            if peer in (None, number):
                try:
                    if client.send(data) < len(data):  # half a frame is no frame: the reader finds the next one
                        self.dropped += 1
                except BlockingIOError:
                    self.dropped += 1
                except OSError:
                    self._hang_up(number)

    def close(self) -> None:
        """Hangs up on everybody."""
        for peer in list(self._clients):
            self._hang_up(peer)
        self._listener.close()


class SerialPort:
    """One vehicle's serial line: a pseudo terminal whose other end a ground station opens by its path."""

    def __init__(self) -> None:
        """Opens a pair; the far end is kept open, so that nobody listening is no error."""
        self._near, self._far = pty.openpty()
        tty.setraw(self._far)
        os.set_blocking(self._near, False)
        self.path = os.ttyname(self._far)
        self.dropped = 0

    def fileno(self) -> int:
        """The near end."""
        return self._near

    def drain(self) -> list[Received]:
        """Everything that has arrived."""
        received: list[Received] = []
        while True:
            try:
                data = os.read(self._near, _DATAGRAM_BYTES)
            except BlockingIOError:
                return received
            received.append(Received(1, data))

    def send(self, peer: int | None, data: bytes) -> None:
        """To the one at the other end; what its buffer has no room for is lost."""
        try:
            if os.write(self._near, data) < len(data):
                self.dropped += 1
        except BlockingIOError:
            self.dropped += 1

    def close(self) -> None:
        """Closes both ends."""
        os.close(self._near)
        os.close(self._far)


def listen(host: str, port: int, option: str) -> socket.socket:
    """A listening TCP socket. Raises PortTakenError, which names the option to change."""
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        raise PortTakenError(
            f"TCP {host}:{port} cannot be bound ({error.strerror}); free it or change {option}"
        ) from error
    listener.listen(MAX_PEERS)
    return listener
