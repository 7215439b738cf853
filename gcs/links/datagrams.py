"""A UDP socket's calls that keep hold of the interpreter.

Python lets go of the interpreter around every call of a socket, also where the call cannot wait, and a thread that
computes gives it back a millisecond or more later. A flight that takes in and sends thousands of datagrams a second
would spend seconds of each second waiting for the web side's threads (measured by ``tests/bench/load.py``: ticks of
two seconds). On Linux the two calls are made through libc without that; elsewhere by the socket, which means the same.
"""

import ctypes
import errno
import os
import socket
import struct
import sys
from functools import lru_cache

MAX_BYTES = 65_535
_ADDRESS_BYTES = 16  # struct sockaddr_in
_EMPTY = frozenset({errno.EAGAIN, errno.EWOULDBLOCK})

Peer = tuple[str, int]


class Datagrams:
    """``receive`` and ``send`` of a non-blocking IPv4 socket; they raise as the socket's own methods do."""

    def __init__(self, own: socket.socket) -> None:
        self._socket = own

    def receive(self) -> tuple[bytes, Peer]:
        """The next datagram and who sent it; BlockingIOError when none is waiting."""
        return self._socket.recvfrom(MAX_BYTES)

    def send(self, data: bytes, peer: Peer) -> None:
        """One datagram."""
        self._socket.sendto(data, peer)


class HeldDatagrams(Datagrams):
    """The same through libc, without letting go of the interpreter."""

    def __init__(self, own: socket.socket) -> None:
        super().__init__(own)
        libc = ctypes.PyDLL(None, use_errno=True)
        self._recvfrom, self._sendto = libc.recvfrom, libc.sendto
        self._recvfrom.restype = self._sendto.restype = ctypes.c_ssize_t
        flags, length = ctypes.c_int, ctypes.c_size_t
        self._recvfrom.argtypes = [flags, ctypes.c_void_p, length, flags, ctypes.c_void_p, ctypes.c_void_p]
        self._sendto.argtypes = [flags, ctypes.c_char_p, length, flags, ctypes.c_char_p, ctypes.c_uint32]
        self._data = bytearray(MAX_BYTES)
        self._address = bytearray(_ADDRESS_BYTES)
        self._length = ctypes.c_uint32(_ADDRESS_BYTES)
        self._data_at = ctypes.addressof((ctypes.c_char * MAX_BYTES).from_buffer(self._data))
        self._address_at = ctypes.addressof((ctypes.c_char * _ADDRESS_BYTES).from_buffer(self._address))
        self._length_at = ctypes.addressof(self._length)

    def receive(self) -> tuple[bytes, Peer]:
        """As :meth:`Datagrams.receive`."""
        self._length.value = _ADDRESS_BYTES
        count = self._recvfrom(
            self._socket.fileno(), self._data_at, MAX_BYTES, socket.MSG_DONTWAIT, self._address_at, self._length_at
        )
        if count < 0:
            _fail()
        return bytes(memoryview(self._data)[:count]), _peer(bytes(self._address[2:8]))

    def send(self, data: bytes, peer: Peer) -> None:
        """As :meth:`Datagrams.send`."""
        if self._sendto(self._socket.fileno(), data, len(data), socket.MSG_DONTWAIT, _packed(peer), _ADDRESS_BYTES) < 0:
            _fail()


def datagrams_of(own: socket.socket) -> Datagrams:
    """The best that this system has."""
    return HeldDatagrams(own) if sys.platform == "linux" else Datagrams(own)


def _fail() -> None:
    number = ctypes.get_errno()
    if number in _EMPTY:
        raise BlockingIOError(number, os.strerror(number))
    raise OSError(number, os.strerror(number))  # Python makes the fitting subclass of it


@lru_cache(maxsize=4096)
def _packed(peer: Peer) -> bytes:
    """struct sockaddr_in: family as this machine writes it, port and address as the network does."""
    return struct.pack("=H", socket.AF_INET) + struct.pack("!H", peer[1]) + socket.inet_aton(peer[0]) + bytes(8)


@lru_cache(maxsize=4096)
def _peer(port_and_address: bytes) -> Peer:
    return socket.inet_ntoa(port_and_address[2:]), int.from_bytes(port_and_address[:2], "big")
