"""A vehicle's end of the wire: a bound socket and pymavlink's own codec, and how to wait for what comes."""

import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common as mav

from gcs.links.fleet_link import WiredFleetLink
from gcs.ports import VelocitySetpoint

PATIENCE_S = 10.0  # of the wall clock: a library with threads of its own answers when it can
PX4_OFFBOARD = 6 << 16


@dataclass(frozen=True)
class Passed:
    """A setpoint that says it passed the gate."""

    setpoint: VelocitySetpoint
    passed_gate: bool = True


class Peer:
    """One vehicle."""

    def __init__(self, system_id: int = 1, key: bytes | None = None) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.05)
        self.codec = mav.MAVLink(None, srcSystem=system_id, srcComponent=1)
        self.codec.robust_parsing = True
        self.ground = ("127.0.0.1", 0)
        if key is not None:
            self.sign(key)

    def sign(self, key: bytes) -> None:
        signing = self.codec.signing
        signing.secret_key, signing.sign_outgoing, signing.link_id = key, True, 3
        signing.timestamp = round((time.time() - 1_420_070_400) * 1e5)

    @property
    def address(self) -> str:
        return f"udpout:127.0.0.1:{self.socket.getsockname()[1]}"

    def read(self) -> list[Any]:
        try:
            data, self.ground = self.socket.recvfrom(4096)
        except TimeoutError:
            return []
        return [m for m in self.codec.parse_buffer(data) or [] if m.get_type() != "BAD_DATA"]

    def say(self, message: Any) -> None:
        data = message.pack(self.codec)
        self.codec.seq = (self.codec.seq + 1) % 256
        self.socket.sendto(data, self.ground)

    def heartbeat(self, autopilot: int = mav.MAV_AUTOPILOT_PX4, kind: int = 2, custom: int = PX4_OFFBOARD) -> None:
        self.say(self.codec.heartbeat_encode(kind, autopilot, 128, custom, 4))

    def position(self, boot_ms: int = 1000, lat_e7: int = 404_203_000) -> None:
        self.say(
            self.codec.global_position_int_encode(boot_ms, lat_e7, -869_300_000, 300_000, 120_000, 1800, -50, 25, 9000)
        )

    def close(self) -> None:
        self.socket.close()


class Desk:
    """A link with its clock, stepped until something is so."""

    def __init__(self, link: WiredFleetLink) -> None:
        self.link, self.now_s = link, 0.0

    def tick(self) -> None:
        """Ten milliseconds of the wall clock, a tenth of a second of the link's."""
        self.now_s += 0.1
        self.link.poll(self.now_s)
        self.link.flush(self.now_s)
        time.sleep(0.01)

    def until(self, true: Callable[[], Any]) -> Any:
        end_s = time.monotonic() + PATIENCE_S
        while not (found := true()):
            assert time.monotonic() < end_s, "not reached in time"
            self.tick()
        return found

    def receive(self, peer: Peer, name: str, fits: Callable[[Any], bool] = lambda _: True) -> Any:
        """The next message of this name that the peer hears."""

        def heard() -> Any:
            return next((m for m in peer.read() if m.get_type() == name and fits(m)), None)

        return self.until(heard)
