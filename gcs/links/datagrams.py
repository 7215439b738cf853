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
AT_ONCE = 8  # a tick's share of a busy vehicle
_ADDRESS_BYTES = 16  # struct sockaddr_in
_EMPTY = frozenset({errno.EAGAIN, errno.EWOULDBLOCK})

Peer = tuple[str, int]


class Datagrams:
    """``receive`` and ``send`` of a non-blocking IPv4 socket; they raise as the socket's own methods do."""

    def __init__(self, own: socket.socket) -> None:
        self._socket = own

    def receive(self) -> list[tuple[bytes, Peer]]:
        """Up to :data:`AT_ONCE` datagrams and who sent them; when they are fewer, no more are waiting now."""
        received: list[tuple[bytes, Peer]] = []
        while len(received) < AT_ONCE:
            try:
                received.append(self._socket.recvfrom(MAX_BYTES))
            except BlockingIOError:
                break
            except ConnectionRefusedError:
                if not received:
                    raise
        return received

    def send(self, data: bytes, peer: Peer) -> None:
        """One datagram."""
        self._socket.sendto(data, peer)


class _Piece(ctypes.Structure):
    """struct iovec."""

    _fields_ = (("base", ctypes.c_void_p), ("length", ctypes.c_size_t))


class _Message(ctypes.Structure):
    """struct msghdr."""

    _fields_ = (
        ("name", ctypes.c_void_p),
        ("name_length", ctypes.c_uint32),
        ("pieces", ctypes.POINTER(_Piece)),
        ("pieces_length", ctypes.c_size_t),
        ("control", ctypes.c_void_p),
        ("control_length", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _Header(ctypes.Structure):
    """struct mmsghdr: where to write, and how many bytes were received."""

    _fields_ = (("message", _Message), ("length", ctypes.c_uint))


class HeldDatagrams(Datagrams):
    """The same through libc, without letting go of the interpreter, and several datagrams a call."""

    def __init__(self, own: socket.socket) -> None:
        super().__init__(own)
        libc = ctypes.PyDLL(None, use_errno=True)
        self._recvmmsg, self._sendto = libc.recvmmsg, libc.sendto
        flags, length = ctypes.c_int, ctypes.c_size_t
        self._recvmmsg.argtypes = [flags, ctypes.c_void_p, ctypes.c_uint, flags, ctypes.c_void_p]
        self._sendto.restype = ctypes.c_ssize_t
        self._sendto.argtypes = [flags, ctypes.c_char_p, length, flags, ctypes.c_char_p, ctypes.c_uint32]
        self._make_room()

    def _make_room(self) -> None:
        """Headers that name a buffer and an address each; the kernel writes into all of them, so they are copied."""
        self._data, self._names = bytearray(AT_ONCE * MAX_BYTES), bytearray(AT_ONCE * _ADDRESS_BYTES)
        self._views = [memoryview(self._data)[i * MAX_BYTES : (i + 1) * MAX_BYTES] for i in range(AT_ONCE)]
        data_at = ctypes.addressof((ctypes.c_char * len(self._data)).from_buffer(self._data))
        names_at = ctypes.addressof((ctypes.c_char * len(self._names)).from_buffer(self._names))
        self._pieces = [_Piece(data_at + i * MAX_BYTES, MAX_BYTES) for i in range(AT_ONCE)]
        self._headers = (_Header * AT_ONCE)(
            *(
                _Header(_Message(names_at + i * _ADDRESS_BYTES, _ADDRESS_BYTES, ctypes.pointer(piece), 1))
                for i, piece in enumerate(self._pieces)
            )
        )
        self._fresh, self._headers_at = bytes(self._headers), ctypes.addressof(self._headers)
        self._headers_view = memoryview(self._headers).cast("B")

    def receive(self) -> list[tuple[bytes, Peer]]:
        """As :meth:`Datagrams.receive`."""
        self._headers_view[:] = self._fresh  # not ctypes.memmove, which lets go of the interpreter
        count = self._recvmmsg(self._socket.fileno(), self._headers_at, AT_ONCE, socket.MSG_DONTWAIT, None)
        if count < 0:
            if ctypes.get_errno() in _EMPTY:
                return []
            _fail()
        return [(bytes(self._views[i][: self._headers[i].length]), self._sender(i)) for i in range(count)]

    def _sender(self, index: int) -> Peer:
        at = _ADDRESS_BYTES * index
        return _peer(bytes(self._names[at + 2 : at + 8]))

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
