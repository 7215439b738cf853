"""UDP ports of the vehicles: each binds its own, answers whoever sends to it, and remembers the last few."""

from __future__ import annotations

import socket
from dataclasses import dataclass

Address = tuple[str, int]
MAX_PEERS = 8  # ground stations remembered a vehicle; the one that was silent longest is forgotten
_BUFFER_BYTES = 4 << 20  # bursts of a whole fleet's setpoints fit
_DATAGRAM_BYTES = 65_535


class PortTakenError(OSError):
    """A port is in use; the message says which and how to choose another."""


@dataclass(frozen=True, slots=True)
class Received:
    """A datagram from a peer; `forgotten` is the peer whose place it took."""

    peer: int
    data: bytes
    forgotten: int | None = None


class Port:
    """One vehicle's socket. Not blocking; a full send buffer drops, as a radio does."""

    def __init__(self, host: str, port: int, target: Address | None) -> None:
        """Binds host:port. `target` is pushed telemetry from the start."""
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)
        try:
            self.socket.bind((host, port))
        except OSError as error:
            self.socket.close()
            raise PortTakenError(
                f"UDP {host}:{port} cannot be bound ({error.strerror}): free it or change --first-port"
            ) from error
        self.address: Address = self.socket.getsockname()
        self._peers: dict[Address, int] = {}  # oldest first
        self._by_number: dict[int, Address] = {}
        self._pinned = target
        self._count = 0
        self.dropped = 0
        if target is not None:
            self._number(target)

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
                data, address = self.socket.recvfrom(_DATAGRAM_BYTES)
            except BlockingIOError:
                return received
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
                self.socket.sendto(data, address)
            except OSError:  # buffer full, or a host that cannot be reached: the datagram is lost
                self.dropped += 1

    def close(self) -> None:
        """Gives the port back."""
        self.socket.close()
